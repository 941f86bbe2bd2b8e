//! Measured coefficients of liquids and solids, by name.

use crate::spectrum::Rgb;

/// Scattering of a named substance, in mm⁻¹.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Preset {
    /// Reduced scattering coefficient.
    pub sigma_s: Rgb,
    /// Absorption coefficient.
    pub sigma_a: Rgb,
}

/// The substance of that exact name; sources stand in the table.
pub fn preset(name: &str) -> Option<Preset> {
    rows()
        .find(|(row_name, _)| *row_name == name)
        .map(|(_, preset)| preset)
}

fn rows() -> impl Iterator<Item = (&'static str, Preset)> {
    let lines = include_str!("presets.csv")
        .lines()
        .filter(|line| !line.starts_with('#'));
    lines.filter_map(|line| {
        let (name, numbers) = line.split_once(',')?;
        let mut numbers = numbers.split(',').map(|n| n.parse::<f32>().ok());
        let mut rgb = || {
            Some(Rgb::new(
                numbers.next()??,
                numbers.next()??,
                numbers.next()??,
            ))
        };
        Some((
            name,
            Preset {
                sigma_s: rgb()?,
                sigma_a: rgb()?,
            },
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_parser::schema::{Family, Type};

    #[test]
    fn every_preset_the_schema_offers_has_coefficients() {
        let medium = Family::Medium.find("homogeneous").expect("a medium type");
        let choices = medium.schema.param("preset").expect("a parameter").types[0];
        let Type::Choice(names) = choices else {
            panic!("presets are a choice")
        };
        let names: Vec<_> = names.iter().filter(|name| !name.is_empty()).collect();
        assert_eq!(names.len(), rows().count());
        for name in names {
            assert!(preset(name).is_some(), "{name}");
        }
        let milk = preset("Wholemilk").expect("it is there");
        assert_eq!(milk.sigma_a.to_array(), [0.0011, 0.0024, 0.014]);
    }
}
