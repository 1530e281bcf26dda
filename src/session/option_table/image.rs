//! Options of images: size, sampling, display and layers.

use super::{Choices, Effect, Heading, OptionDef, choose, names, store};
use crate::options::ImageBackground;
use crate::values::{self, whole};
use blinn_render::display::{Background, Look, ViewTransform};
use blinn_render::{Denoise, PixelFilter};

const BASE: OptionDef = OptionDef { heading: Heading::Image, ..OptionDef::BASE };

const FILTERS: Choices<PixelFilter, 4> = [
    ("box", PixelFilter::Box),
    ("tent", PixelFilter::Tent),
    ("gaussian", PixelFilter::Gaussian),
    ("blackman-harris", PixelFilter::BlackmanHarris),
];
/// Samples and diffuse bounces.
const QUALITIES: Choices<(u32, Option<u8>), 3> =
    [("draft", (4, Some(2))), ("standard", (16, Some(4))), ("final", (128, Some(8)))];
const DENOISING: Choices<Denoise, 3> = [("auto", Denoise::Auto), ("on", Denoise::On), ("off", Denoise::Off)];
const VIEW_TRANSFORMS: Choices<Option<ViewTransform>, 6> = [
    ("auto", None),
    ("standard", Some(ViewTransform::Standard)),
    ("agx", Some(ViewTransform::Agx)),
    ("filmic", Some(ViewTransform::Filmic)),
    ("pbr-neutral", Some(ViewTransform::PbrNeutral)),
    ("raw", Some(ViewTransform::Raw)),
];

const LOOKS: Choices<Option<Look>, 11> = [
    ("none", Some(Look::None)),
    ("very-low-contrast", Some(Look::VeryLowContrast)),
    ("low-contrast", Some(Look::LowContrast)),
    ("medium-low-contrast", Some(Look::MediumLowContrast)),
    ("medium-contrast", Some(Look::MediumContrast)),
    ("base-contrast", Some(Look::BaseContrast)),
    ("medium-high-contrast", Some(Look::MediumHighContrast)),
    ("high-contrast", Some(Look::HighContrast)),
    ("very-high-contrast", Some(Look::VeryHighContrast)),
    ("punchy", Some(Look::Punchy)),
    ("greyscale", Some(Look::Greyscale)),
];

pub static IMAGE: &[OptionDef] = &[
    OptionDef {
        name: "size",
        alias: Some("resolution"),
        value_name: "WxH",
        help: "Width and height in pixels, or one number for both [default: 1280x720, or the aspect ratio of the file's camera]",
        effect: Effect::Value(|options, text| store(&mut options.size, values::size(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "max-size",
        value_name: "N",
        help: "Longer side in pixels, for thumbnails: the image has the aspect ratio of the file's camera, or is square",
        conflicts: &["size"],
        effect: Effect::Value(|options, text| {
            store(&mut options.max_size, whole(text, 1..=16_384).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "samples",
        short: Some('s'),
        value_name: "SAMPLES",
        default: Some("4"),
        help: "Samples per pixel; a single sample is at the pixel's centre",
        effect: Effect::Value(|options, text| store(&mut options.samples, whole(text, 1..=65_536))),
        ..BASE
    },
    OptionDef {
        name: "quality",
        value_name: "QUALITY",
        choices: &names(&QUALITIES),
        help: "Samples and bounced light together: draft (`samples 4`, `indirect 2`), standard (`samples 16`, \
               `indirect 4`) or final (`samples 128`, `indirect 8`)\n\n\
               `samples` or `indirect` beside it takes precedence.",
        conflicts: &["ao"],
        presets: &["samples", "indirect"],
        effect: Effect::Value(|options, text| {
            let mut quality = (options.samples, options.indirect);
            choose(&mut quality, text, &QUALITIES)?;
            (options.samples, options.indirect) = quality;
            Ok(())
        }),
        ..BASE
    },
    OptionDef {
        name: "adaptive",
        value_name: "THRESHOLD",
        help: "Adaptive sampling: use all `samples` only where neighbouring pixels differ by more than THRESHOLD (0–1), \
               4 elsewhere\n\nWith 16 or more samples, 0.08 takes about half the time for the same error.",
        effect: Effect::Value(|options, text| store(&mut options.adaptive, values::fraction(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "denoise",
        value_name: "DENOISE",
        choices: &names(&DENOISING),
        default: Some("auto"),
        help: "Remove the noise of light that few samples find: of area lights, soft shadows, ambient occlusion, indirect \
               light and rough metals (auto), the last with the slower, better filter (on), or of none (off)\n\n\
               Textures and edges stay sharp. Images with `adaptive` keep their noise.",
        effect: Effect::Value(|options, text| choose(&mut options.denoise, text, &DENOISING)),
        ..BASE
    },
    OptionDef {
        name: "filter",
        value_name: "FILTER",
        choices: &names(&FILTERS),
        default: Some("blackman-harris"),
        help: "Reconstruction filter",
        effect: Effect::Value(|options, text| choose(&mut options.filter, text, &FILTERS)),
        ..BASE
    },
    OptionDef {
        name: "background",
        value_name: "COLOR|transparent|hdri",
        help: "Background: a colour, none (transparent), or the environment of `hdri` or the file (hdri) \
               [default: .05]\n\n\
               A colour is R,G,B or one number in linear light (.5 is 188 of 255 in the picture); or as displayed: a \
               name of CSS such as orange, #rrggbb, #rgb, or srgb(R,G,B) from 0 to 1 (srgb(.5) is 128). Exposure and \
               `view` do not change it.",
        effect: Effect::Value(|options, text| {
            store(&mut options.background, values::image_background(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "background-blur",
        value_name: "BLUR",
        help: "Blur `background hdri`: from 0 (sharp) to 1, like the reflection of a surface of that roughness \
               [default: 0]",
        effect: Effect::Value(|options, text| {
            store(&mut options.background_blur, values::fraction(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "no-background",
        help: "Same as `background transparent`",
        is_hidden: true,
        conflicts: &["background"],
        effect: Effect::Flag(|options| {
            options.background = Some(ImageBackground::Fixed(Background::Transparent));
        }),
        ..BASE
    },
    OptionDef {
        name: "exposure",
        value_name: "auto|EV",
        help: "Exposure in stops (EV), or auto to meter the scene\n\n\
               [default: 0 for light rigs, glowing surfaces alone, lights from flags and Blender's files near mid-grey; else auto]",
        effect: Effect::Value(|options, text| store(&mut options.exposure, values::exposure(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "view",
        value_name: "VIEW",
        choices: &names(&VIEW_TRANSFORMS),
        default: Some("auto"),
        help: "View transform from linear light to display colours; auto is agx for Blender's glTF files, filmic before Blender 4.0, else standard",
        effect: Effect::Value(|options, text| choose(&mut options.view_transform, text, &VIEW_TRANSFORMS)),
        ..BASE
    },
    OptionDef {
        name: "look",
        value_name: "LOOK",
        choices: &names(&LOOKS),
        help: "Look of the view transform, as in Blender: all but medium-contrast with agx; those named by contrast, except \
               base-contrast, with filmic, standard and pbr-neutral [default: that of the file, else none]",
        effect: Effect::Value(|options, text| choose(&mut options.look, text, &LOOKS)),
        ..BASE
    },
    OptionDef {
        name: "gamma",
        value_name: "F",
        help: "Gamma of the display: encoded colours are raised to the power 1/F, backgrounds are not [default: that of the file, else 1]",
        effect: Effect::Value(|options, text| store(&mut options.gamma, values::gamma(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "aov",
        heading: Heading::Output,
        value_name: "LIST",
        help: "AOVs: depth, normal, vertex-normal, geometric-normal, position, albedo, uv, mask, object-id, \
               material-id, steps, distance, camera-normal, camera-position, nocs, flow-forward, flow-backward, \
               barycentric, triangle-id, diffuse-direct, diffuse-indirect, specular-direct, specular-indirect, emission, \
               environment, cryptomatte\n\n\
               They are channels of an .exr, and previews named OUT.<aov>.png beside other images. The six from \
               diffuse-direct on are the light of the picture: they add up to its linear colours.",
        effect: Effect::Value(|options, text| store(&mut options.aovs, values::aovs(text))),
        ..BASE
    },
    OptionDef {
        name: "depth-unit",
        heading: Heading::Output,
        value_name: "mm|m|SCALE",
        help: "Unit of the 16-bit depth beside images, for `aov depth`: mm, m or metres per step\n\n\
               OUT.depth.png then holds depths in place of a preview; 0 means no hit. [default for `views`: fits the \
               scene]",
        effect: Effect::Value(|options, text| {
            store(&mut options.depth_unit, values::depth_unit(text).map(Some))
        }),
        ..BASE
    },
    OptionDef {
        name: "crop",
        value_name: "X,Y,W,H",
        help: "Render only a region: left, top, width and height in pixels",
        effect: Effect::Value(|options, text| store(&mut options.crop, values::crop(text).map(Some))),
        ..BASE
    },
    OptionDef {
        name: "seed",
        value_name: "SEED",
        default: Some("0"),
        help: "Seed of the sample positions",
        effect: Effect::Value(|options, text| store(&mut options.seed, whole(text, 0..=u32::MAX.into()))),
        ..BASE
    },
];
