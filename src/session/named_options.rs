//! Options that users set by name, and checks between them.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use crate::error::SessionError;
use crate::option_table::{Effect, OptionDef, option_defs};
use crate::options::Options;
use blinn_core::closest_name::did_you_mean;
use blinn_core::geometry::Rgb;
use blinn_core::worded;
use blinn_render::Denoise;
use blinn_render::integrator::Stage;
use blinn_scene::{GroundKind, LightSet, Projection};

impl Options {
    /// Sets the option that [`option_defs`](crate::option_defs) lists under `name`, as `--name text` does on the command
    /// line. Options without a value ignore `text`.
    ///
    /// ```
    /// let mut options = blinn_session::Options::default();
    /// options.set("size", "640x480")?;
    /// assert_eq!(options.size, Some((640, 480)));
    /// assert!(options.set("samples", "many").unwrap_err().to_string().contains("expected a whole number"));
    /// # Ok::<(), blinn_session::SessionError>(())
    /// ```
    ///
    /// # Errors
    /// There is no such option, or it has another form.
    pub fn set(&mut self, name: &str, text: impl AsRef<OsStr>) -> Result<(), SessionError> {
        let def = OptionDef::find(name).ok_or_else(|| {
            let names = option_defs().map(|def| def.name);
            SessionError::Option(worded!("there is no option `{}`{}", name, did_you_mean(name, names)))
        })?;
        let text = text.as_ref();
        def.apply(self, text).map_err(|reason| {
            SessionError::Option(worded!("invalid value '{}' for `{}`: {}", text.display(), def.name, reason))
        })
    }
}

impl OptionDef {
    /// Sets the option.
    ///
    /// # Errors
    /// The form that is expected.
    pub fn apply(&self, options: &mut Options, text: &OsStr) -> Result<(), String> {
        match self.effect {
            Effect::Flag(set) => set(options),
            Effect::Value(set) => set(options, text.to_str().ok_or("expected UTF-8")?)?,
            Effect::Path(set) => set(options, Path::new(text)),
        }
        Ok(())
    }
}

/// Options that are set one by one, by name. [`NamedOptions::finish`] finds those that exclude each other or have no
/// effect.
#[derive(Clone, Debug, Default)]
pub struct NamedOptions {
    options: Options,
    /// Names and values of the options that were set, in order.
    values: Vec<(&'static str, OsString)>,
}

impl NamedOptions {
    /// Sets an option as [`Options::set`] does.
    ///
    /// # Errors
    /// As [`Options::set`].
    pub fn set(&mut self, name: &str, text: impl AsRef<OsStr>) -> Result<(), SessionError> {
        let text = text.as_ref();
        self.options.set(name, text)?;
        let Some(def) = OptionDef::find(name) else { return Ok(()) };
        // Values of a preset give way to those that are set beside it, in any order.
        for (other, text) in self.values.iter().filter(|(other, _)| def.presets.contains(other)) {
            self.options.set(other, text)?;
        }
        self.values.push((def.name, text.to_owned()));
        Ok(())
    }

    /// True if an option was set.
    pub fn contains(&self, name: &str) -> bool {
        self.values.iter().any(|(set, _)| *set == name)
    }

    /// Returns the options.
    ///
    /// # Errors
    /// Two options that exclude each other, an option without one that it needs, or an option without effect.
    pub fn finish(self) -> Result<Options, SessionError> {
        self.check_names().and_then(|()| self.check_effects()).map_err(SessionError::Option)?;
        Ok(self.options)
    }

    fn check_names(&self) -> Result<(), String> {
        for def in self.values.iter().filter_map(|(name, _)| OptionDef::find(name)) {
            if let Some(other) = def.conflicts.iter().find(|other| self.contains(other)) {
                return Err(worded!("`{}` cannot be used with `{}`", def.name, other));
            }
            if let Some(needed) = def.requires.filter(|needed| !self.contains(needed)) {
                return Err(worded!("`{}` needs `{}`", def.name, needed));
            }
        }
        Ok(())
    }

    fn check_effects(&self) -> Result<(), String> {
        self.check_lights()?;
        self.check_shadows()?;
        let options = &self.options;
        if let (Some(crop), Some((width, height))) = (options.crop, options.size)
            && (crop.x + crop.width > width || crop.y + crop.height > height)
        {
            return Err(worded!("`crop` reaches beyond the image of {}x{} pixels", width, height));
        }
        if options.adaptive.is_some() && options.samples <= 4 {
            return Err(worded!("`adaptive` needs more than 4 samples; set `samples 16`"));
        }
        if options.adaptive.is_some() && options.aovs.aovs.iter().any(|aov| aov.light().is_some()) {
            return Err(worded!(
                "`aov`: layers of light need the same samples in all pixels; remove `adaptive`"
            ));
        }
        if options.adaptive.is_some() && options.denoise == Denoise::On {
            return Err(worded!("`denoise on` needs the same samples in all pixels; remove `adaptive`"));
        }
        if options.environment_blur().is_some() && options.stage != Stage::Phong {
            return Err(worded!(
                "`background hdri` shows the environment, which only `integrator phong` has; remove one of them"
            ));
        }
        if options.background_blur.is_some() && options.environment_blur().is_none() {
            return Err(worded!("`background-blur` applies only to `background hdri`"));
        }
        options.check_projection()
    }

    /// Finds light options that have no effect.
    fn check_lights(&self) -> Result<(), String> {
        let Options { lighting, ao, stage, .. } = &self.options;
        if let Some(sources) = lighting.sets.as_ref().filter(|sources| !sources.contains(&LightSet::File))
            && self.contains("light-scale")
        {
            let lights =
                if sources.is_empty() { worded!("`lights none`") } else { worded!("`lights` without file") };
            return Err(worded!(
                "`light-scale` applies to the file's lights, which {} disables; remove one of them",
                lights
            ));
        }
        for (name, is_set) in [("ao", ao.is_some()), ("hdri", self.options.environment.is_some())] {
            if is_set && *stage != Stage::Phong {
                return Err(worded!(
                    "`{}` changes the ambient term, which only `integrator phong` has; remove one of them",
                    name
                ));
            }
        }
        if ao.is_some() && lighting.ambient == Some(Rgb::ZERO) {
            return Err(worded!("`ao` has no effect with `ambient 0,0,0`; remove one of them"));
        }
        Ok(())
    }

    /// Finds options of shadows that have no effect.
    fn check_shadows(&self) -> Result<(), String> {
        let options = &self.options;
        let Some(cause) = options.no_shadows_cause() else { return Ok(()) };
        if options.lighting.radius.is_some_and(|radius| radius > 0.0) {
            return Err(worded!(
                "`light-radius` softens shadows, which {} disables; remove one of them",
                cause
            ));
        }
        if options.ground == Some(GroundKind::ShadowCatcher) && options.ao.is_none() {
            return Err(worded!(
                "`ground shadow` shows only shadows, which {} disables; use `ground plane`",
                cause
            ));
        }
        Ok(())
    }
}

impl Options {
    /// Checks that pixels of a perspective camera have a perspective projection.
    pub(crate) fn check_projection(&self) -> Result<(), String> {
        if self.view.intrinsics.is_some() && self.view.projection == Some(Projection::Orthographic) {
            return Err(worded!(
                "`intrinsics` describes a perspective camera; remove the orthographic projection"
            ));
        }
        Ok(())
    }

    /// The option that disables all shadows, if any.
    fn no_shadows_cause(&self) -> Option<String> {
        let lighting = &self.lighting;
        let has_no_lights =
            lighting.sets.as_ref().is_some_and(Vec::is_empty) && lighting.user_lights.is_empty();
        match self.stage {
            Stage::Color => Some(worded!("`integrator color`")),
            Stage::Diffuse => Some(worded!("`integrator diffuse`")),
            _ if !self.shadows => Some(worded!("`no-shadows`")),
            _ if has_no_lights => Some(worded!("`lights none`")),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error of options `name=value …`.
    fn error(line: &str) -> String {
        let mut options = NamedOptions::default();
        for option in line.split(' ') {
            let (name, value) = option.split_once('=').unwrap_or((option, ""));
            if let Err(error) = options.set(name, value) {
                return error.to_string();
            }
        }
        options.finish().err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn presets_give_way_to_what_is_set_beside_them_in_any_order() {
        let set = |line: &str| {
            let mut options = NamedOptions::default();
            for option in line.split(' ') {
                let (name, value) = option.split_once('=').unwrap();
                options.set(name, value).unwrap();
            }
            let options = options.finish().unwrap();
            (options.samples, options.indirect)
        };
        assert_eq!(set("quality=standard"), (16, Some(4)));
        assert_eq!(set("samples=9 quality=final"), (9, Some(8)));
        assert_eq!(set("quality=final samples=9"), (9, Some(8)));
        assert_eq!(set("indirect=0 samples=9 quality=draft"), (9, Some(0)));
        assert!(error("quality=best").contains("expected draft, standard, final"));
        assert_eq!(error("quality=draft ao=4"), "`quality` cannot be used with `ao`");
    }

    #[test]
    fn options_are_checked_one_by_one_and_together() {
        for (line, expected) in [
            ("samples=16 adaptive=.1 size=8x8", ""),
            ("sampels=4", "there is no option `sampels`"),
            ("samples=0", "invalid value '0' for `samples`: 0 is not in 1..=65536"),
            (
                "filter=sinc",
                "invalid value 'sinc' for `filter`: expected box, tent, gaussian, blackman-harris",
            ),
            ("size=8x8 max-size=9", "`max-size` cannot be used with `size`"),
            ("resolution=8x8 max-size=9", "`max-size` cannot be used with `size`"),
            ("intrinsics=1,1,1,1", "`intrinsics` needs `size`"),
            ("adaptive=.1", "`adaptive` needs more than 4 samples"),
            ("samples=16 adaptive=.1 aov=depth,emission", "layers of light need the same samples"),
            ("samples=16 adaptive=.1 denoise=on", "`denoise on` needs the same samples in all pixels"),
            ("background-blur=.5", "`background-blur` applies only to"),
            ("background=hdri integrator=color", "`background hdri` shows the environment"),
            ("size=8x8 crop=4,4,8,1", "`crop` reaches beyond the image of 8x8 pixels"),
            ("lights=headlight light-scale=1", "`lights` without file disables"),
            ("ao=4 ambient=0,0,0", "`ao` has no effect"),
            ("hdri=sky integrator=shadow", "`hdri` changes the ambient term"),
            ("light-radius=1 no-shadows", "which `no-shadows` disables"),
            ("ground=shadow lights=none", "which `lights none` disables; use `ground plane`"),
            ("ground=shadow lights=none sun=0,-1,0,1", ""),
            ("size=8x8 intrinsics=1,1,1,1 projection=orthographic", "remove the orthographic projection"),
        ] {
            let error = error(line);
            assert!(error.contains(expected) && error.is_empty() == expected.is_empty(), "{line}: {error}");
        }
    }

    #[test]
    fn the_order_of_options_decides_nothing() {
        let options = |names: [(&str, &str); 3]| {
            let mut options = NamedOptions::default();
            names.iter().for_each(|(name, value)| options.set(name, value).unwrap());
            format!("{:?}", options.finish().unwrap())
        };
        let (sun, point, blur) = (("sun", "0,-1,0,1"), ("point-light", "0,1,0,1"), ("background", "hdri"));
        assert_eq!(options([sun, blur, point]), options([point, sun, blur]));
    }
}
