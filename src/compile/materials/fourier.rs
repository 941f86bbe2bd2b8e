//! The tables of `fourier` materials: each file is read once, however many materials name it.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::Family;
use tyndall_parser::source::Spanned;

use super::MaterialBuilder;
use super::models::default_matte;
use crate::compile::assets::{Assets, read_file};
use crate::compile::textures::TextureBuilder;
use crate::describe::description::ShapeEntity;
use crate::ids::FourierTableId;
use crate::material::{Fourier, Material, Model};
use crate::scatter::fourier::{self, FourierTable};

impl MaterialBuilder {
    pub(super) fn fourier(
        &mut self,
        index: usize,
        shape: Option<&ShapeEntity>,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> Material {
        let Some(plugin) = Family::Material.find("fourier") else {
            return default_matte();
        };
        let reader = self.reader(plugin, index, shape, textures, diagnostics);
        let (file, bump) = reader.table_file();
        let table = match file {
            Some(file) => self.table(&file, textures.assets(), diagnostics),
            None => FourierTableId::NONE,
        };
        Material {
            model: Model::Fourier(Fourier { table }),
            bump,
        }
    }

    /// The table in a file; `NONE` if it cannot be read, which is reported at the first place that names it.
    fn table(
        &mut self,
        file: &Spanned<String>,
        assets: &dyn Assets,
        diagnostics: &mut Diagnostics,
    ) -> FourierTableId {
        if let Some(id) = self.tables.get(&file.value) {
            return *id;
        }
        let id = match read(file, assets) {
            Ok(table) => {
                self.built.tables.push(table);
                FourierTableId::new(self.built.tables.len() - 1)
            }
            Err(diagnostic) => {
                diagnostics.push(*diagnostic);
                FourierTableId::NONE
            }
        };
        self.tables.insert(file.value.clone(), id);
        id
    }
}

fn read(file: &Spanned<String>, assets: &dyn Assets) -> Result<FourierTable, Box<Diagnostic>> {
    let fail = |code: &'static str, message: String| {
        Box::new(Diagnostic::error(code, file.span, message).with_label("the surface is black"))
    };
    let bytes = read_file(file, assets)
        .map_err(|missing| Box::new(missing.with_label("the surface is black")))?;
    fourier::decode((*bytes).as_ref()).map_err(|error| {
        let message = format!("cannot use \"{}\": {error}", file.value);
        fail("bad-bsdf", message)
    })
}
