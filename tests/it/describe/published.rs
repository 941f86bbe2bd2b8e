//! Published scenes.

use std::path::Path;
use std::sync::Arc;
use tyndall::compile::reader::ParamReader;
use tyndall::describe::describe;
use tyndall::describe::description::{Entity, SceneDescription, TextureType};
use tyndall_parser::diagnostic::Style;
use tyndall_parser::schema::Family;
use tyndall_parser::{LoadError, Loaded, Sources, parse};

/// Reads a scene with its includes and finds unknown plugins and parameters without effect in all of it.
fn findings_of(path: &Path) -> (SceneDescription, String) {
    let mut sources = Sources::new();
    let file = sources.add_text(path.display().to_string(), std::fs::read(path).unwrap());
    let loader = |included: &str, top: &str| {
        let path = Path::new(top).parent().unwrap().join(included);
        let bytes = std::fs::read(&path).map_err(|error| LoadError::new(error.to_string()))?;
        Ok(Loaded {
            name: path.display().to_string(),
            bytes: Arc::new(bytes),
        })
    };
    let (scene, mut found) = parse(&mut sources, file, &loader);
    let (description, more) = describe(scene);
    found.list.extend(more.list);
    let mut check = |family: Family, entity: &Entity| match family.lookup(&entity.kind) {
        Ok(plugin) => ParamReader::new(plugin, entity, &mut found).finish(),
        Err(finding) => found.push(*finding),
    };
    for frame in &description.frames {
        check(Family::Camera, &frame.camera.entity);
        check(Family::Film, &frame.film);
        check(Family::Filter, &frame.filter);
        check(Family::Sampler, &frame.sampler);
        check(Family::Accelerator, &frame.accelerator);
        check(Family::Integrator, &frame.integrator);
        frame
            .media
            .iter()
            .for_each(|medium| check(Family::Medium, &medium.entity));
        frame
            .materials
            .iter()
            .for_each(|material| check(Family::Material, &material.entity));
        frame
            .lights
            .iter()
            .for_each(|light| check(Family::Light, &light.entity));
        frame
            .area_lights
            .iter()
            .for_each(|light| check(Family::AreaLight, light));
        frame
            .shapes
            .iter()
            .for_each(|shape| check(Family::Shape, &shape.entity));
        for texture in &frame.textures {
            let family = match texture.value_type {
                TextureType::Float => Family::FloatTexture,
                TextureType::Spectrum => Family::SpectrumTexture,
            };
            check(family, &texture.entity);
        }
    }
    (description, found.render(&sources, Style::Plain))
}

#[test]
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn published_scenes_have_nothing_to_complain_about() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let Ok(folders) = std::fs::read_dir(&scenes) else {
        println!("skipped: no scenes at {}", scenes.display());
        return;
    };
    let files = folders
        .flatten()
        .filter_map(|folder| std::fs::read_dir(folder.path()).ok());
    let mut n_scenes = 0;
    for path in files
        .flat_map(|files| files.flatten())
        .map(|file| file.path())
    {
        let is_scene = path
            .extension()
            .is_some_and(|extension| extension == "pbrt");
        // Parts that scenes include are no scenes.
        if !is_scene
            || ["geometry", "materials"]
                .iter()
                .any(|part| path.file_stem().unwrap() == *part)
        {
            continue;
        }
        let (description, findings) = findings_of(&path);
        assert_eq!(findings, "", "{}", path.display());
        assert_eq!(description.frames.len(), 1, "{}", path.display());
        assert!(
            !description.frames[0].shapes.is_empty(),
            "{}",
            path.display()
        );
        n_scenes += 1;
    }
    assert!(n_scenes > 10, "{n_scenes}");
}
