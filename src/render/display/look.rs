//! Looks of Blender's view transforms, by name.
//!
//! AgX has looks of its own (`agx_look`). The other views have those of Filmic (`filmic_look`).

use crate::display::ViewTransform;

/// A look: a change of light before the view transform. Those named by contrast differ between AgX and the other views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum Look {
    /// The view transform alone.
    #[default]
    None,
    /// Contrast 0.7 and saturation 1.15 of AgX, 0.35 of Filmic.
    VeryLowContrast,
    /// Contrast 0.8 and saturation 1.1 of AgX, 0.48 of Filmic.
    LowContrast,
    /// Contrast 0.9 and saturation 1.05 of AgX, 0.6 of Filmic.
    MediumLowContrast,
    /// Contrast 0.7 of Filmic, which it has without a look as well. AgX has none of this name.
    MediumContrast,
    /// Contrast 1 of AgX only: colours outside of Rec.2020 change.
    BaseContrast,
    /// Contrast 1.2 of AgX, 0.85 of Filmic.
    MediumHighContrast,
    /// Contrast 1.4 and saturation 0.95 of AgX, 0.99 of Filmic.
    HighContrast,
    /// Contrast 1.57 and saturation 0.9 of AgX, 1.2 of Filmic.
    VeryHighContrast,
    /// AgX only: darker, with deep shadows.
    Punchy,
    /// AgX only: black and white.
    Greyscale,
}

/// Prefix of the names of AgX's looks in Blender.
const AGX_PREFIX: &str = "AgX - ";

impl Look {
    /// Returns the look of `view` that Blender calls `name`; `None` if the view has none of this name.
    pub fn of_blender(name: &str, view: ViewTransform) -> Option<Look> {
        let bare = match view {
            ViewTransform::Agx => name.strip_prefix(AGX_PREFIX).unwrap_or(name),
            _ => name,
        };
        let look = match bare {
            "" | "None" => Look::None,
            "Very Low Contrast" => Look::VeryLowContrast,
            "Low Contrast" => Look::LowContrast,
            "Medium Low Contrast" => Look::MediumLowContrast,
            "Medium Contrast" => Look::MediumContrast,
            "Base Contrast" => Look::BaseContrast,
            "Medium High Contrast" => Look::MediumHighContrast,
            "High Contrast" => Look::HighContrast,
            "Very High Contrast" => Look::VeryHighContrast,
            "Punchy" => Look::Punchy,
            "Greyscale" => Look::Greyscale,
            _ => return None,
        };
        look.is_of(view).then_some(look)
    }

    /// True if `view` has the look.
    pub fn is_of(self, view: ViewTransform) -> bool {
        match self {
            Look::None => true,
            Look::BaseContrast | Look::Punchy | Look::Greyscale => view == ViewTransform::Agx,
            Look::MediumContrast => !matches!(view, ViewTransform::Agx | ViewTransform::Raw),
            _ => view != ViewTransform::Raw,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_blender() {
        use ViewTransform::{Agx, Filmic, PbrNeutral, Raw, Standard};
        assert_eq!(Look::of_blender("AgX - Punchy", Agx), Some(Look::Punchy));
        assert_eq!(Look::of_blender("AgX - Base Contrast", Agx), Some(Look::BaseContrast));
        for view in [Filmic, Standard, PbrNeutral] {
            assert_eq!(Look::of_blender("High Contrast", view), Some(Look::HighContrast), "{view:?}");
            assert_eq!(Look::of_blender("Medium Contrast", view), Some(Look::MediumContrast), "{view:?}");
            assert_eq!(Look::of_blender("AgX - High Contrast", view), None, "{view:?}");
            assert_eq!(Look::of_blender("Base Contrast", view), None, "{view:?}");
        }
        assert_eq!(Look::of_blender("AgX - Medium Contrast", Agx), None);
        assert_eq!(Look::of_blender("False Color - Punchy", Agx), None);
        assert_eq!(Look::of_blender("High Contrast", Raw), None);
        for view in [Standard, Agx, Filmic, PbrNeutral, Raw] {
            assert_eq!(Look::of_blender("None", view), Some(Look::None));
        }
    }
}
