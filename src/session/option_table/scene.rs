//! Options that select and interpret scene files.

use super::{Choices, Effect, Heading, OptionDef, choose, names, store};
use crate::values;
use blinn_import::{BakeMode, GlassMode, MtlColors, SceneChoice};
use blinn_scene::{SourceFormat, UpAxis};

const BASE: OptionDef = OptionDef { heading: Heading::Scene, ..OptionDef::BASE };

const FORMATS: Choices<Option<SourceFormat>, 5> = [
    ("gltf", Some(SourceFormat::Gltf)),
    ("glb", Some(SourceFormat::Gltf)),
    ("obj", Some(SourceFormat::Obj)),
    ("stl", Some(SourceFormat::Stl)),
    ("ply", Some(SourceFormat::Ply)),
];
const UP_AXES: Choices<Option<UpAxis>, 2> = [("y", Some(UpAxis::Y)), ("z", Some(UpAxis::Z))];
const BAKE_MODES: Choices<Option<BakeMode>, 2> =
    [("never", Some(BakeMode::Never)), ("auto", Some(BakeMode::Auto))];
const GLASS_MODES: Choices<GlassMode, 3> =
    [("auto", GlassMode::Auto), ("thin", GlassMode::Thin), ("solid", GlassMode::Solid)];
const MTL_COLORS: Choices<MtlColors, 3> =
    [("auto", MtlColors::Auto), ("srgb", MtlColors::Srgb), ("linear", MtlColors::Linear)];

pub static SCENE: &[OptionDef] = &[
    OptionDef {
        name: "format",
        value_name: "FORMAT",
        choices: &names(&FORMATS),
        help: "Format of the scene files, which is otherwise detected",
        effect: Effect::Value(|options, text| choose(&mut options.load.format, text, &FORMATS)),
        ..BASE
    },
    OptionDef {
        name: "blender",
        value_name: "PATH",
        help: "Program that converts .blend files: Blender 4.2 or later, or a Python with the module bpy [default: \
               $BLINN_BLENDER, or the newest on PATH]",
        effect: Effect::Path(|options, path| options.blender = Some(path.into())),
        ..BASE
    },
    OptionDef {
        name: "bake",
        value_name: "MODE",
        choices: &names(&BAKE_MODES),
        help: "Nodes of materials in .blend files that glTF has no form for: auto bakes them to images with Cycles, never \
               leaves them out with a warning [default: the scene's setting, or never]",
        effect: Effect::Value(|options, text| choose(&mut options.load.bake, text, &BAKE_MODES)),
        ..BASE
    },
    OptionDef {
        name: "bake-size",
        value_name: "TEXELS",
        help: "Texels on a side of baked images [default: the scene's setting, or 1024]",
        effect: Effect::Value(|options, text| {
            store(&mut options.load.bake_size, values::whole(text, 64..=4096).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "scene",
        value_name: "NAME|INDEX",
        help: "Scene within the file, by name or index",
        effect: Effect::Value(|options, text| {
            store(&mut options.load.scene, Ok(SceneChoice::Named(text.into())))
        }),
        ..BASE
    },
    OptionDef {
        name: "variant",
        value_name: "NAME",
        help: "Material variant of a glTF file, by name; none for the default materials",
        effect: Effect::Value(|options, text| store(&mut options.load.variant, Ok(Some(text.into())))),
        ..BASE
    },
    OptionDef {
        name: "up",
        value_name: "UP",
        choices: &names(&UP_AXES),
        help: "Up axis of the file [default: z for STL and PLY, y for others]",
        effect: Effect::Value(|options, text| choose(&mut options.load.up, text, &UP_AXES)),
        ..BASE
    },
    OptionDef {
        name: "scale",
        value_name: "FACTOR",
        help: "Multiply all lengths of the file, such as 0.001 for millimetres that are written as metres [default: \
               1]\n\n\
               Meshes, animations, the places of cameras and lights, clip planes, radii, ranges and volumes are scaled. \
               Intensities of lights stay as they are, in candela and lux, so that lights at a thousandth of their \
               distance are brighter.",
        effect: Effect::Value(|options, text| {
            store(&mut options.load.scale, values::length_scale(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "mtl-colors",
        value_name: "COLORS",
        choices: &names(&MTL_COLORS),
        default: Some("auto"),
        help: "Encoding of the colours in MTL files: srgb, linear, or auto to decide by the exporter",
        effect: Effect::Value(|options, text| choose(&mut options.load.mtl_colors, text, &MTL_COLORS)),
        ..BASE
    },
    OptionDef {
        name: "glass",
        value_name: "GLASS",
        choices: &names(&GLASS_MODES),
        default: Some("auto"),
        help: "Transmissive meshes: thin walls, solid bodies that refract, or auto to decide by volumes, exporter and \
               closed surfaces",
        effect: Effect::Value(|options, text| choose(&mut options.load.glass, text, &GLASS_MODES)),
        ..BASE
    },
    OptionDef {
        name: "smooth",
        value_name: "ANGLE|off|file|auto",
        default: Some("auto"),
        help: "Recompute normals: smooth across edges below ANGLE degrees, or flat (off); file keeps the file's, and auto \
               too, except for programs that smooth-shade everything",
        effect: Effect::Value(|options, text| store(&mut options.load.normals, values::smooth(text))),
        ..BASE
    },
];

pub static TIME_AND_FILES: &[OptionDef] = &[
    OptionDef {
        name: "animation",
        heading: Heading::Time,
        value_name: "NAME|INDEX|all|none",
        help: "Animation by name or index, all, or none for the rest pose",
        effect: Effect::Value(|options, text| store(&mut options.animation, Ok(Some(text.into())))),
        ..BASE
    },
    OptionDef {
        name: "allow-outside",
        heading: Heading::Process,
        help: "Allow files outside the scene's folder",
        effect: Effect::Flag(|options| options.load.allow_outside = true),
        ..BASE
    },
];
