//! Views of a sheet that show nothing.

use std::collections::BTreeMap;

use blinn_session::{EmptyReason, Notice};

/// The names of views that show nothing, by their reasons.
#[derive(Debug, Default)]
pub struct EmptyViews(BTreeMap<EmptyReason, Vec<String>>);

impl EmptyViews {
    /// Adds a view.
    pub fn add(&mut self, reason: EmptyReason, view: &str) {
        self.0.entry(reason).or_default().push(view.into());
    }

    /// The message about all of them. `None` if there is none, or if it is known that there are no objects.
    pub fn summary(&self) -> Option<Notice> {
        let unknown = self.0.iter().filter(|(reason, _)| **reason != EmptyReason::NoObjects);
        let part = |(reason, views): (&EmptyReason, &Vec<String>)| {
            let words = if views.len() == 1 { ["view", "shows"] } else { ["views", "show"] };
            let reason = match reason {
                // The camera of a view is not chosen by `look-at` and `orbit`.
                EmptyReason::NothingInView | EmptyReason::LooksAway | EmptyReason::TooSmall => {
                    "no object is seen from there, as flat ones from their edges".to_string()
                }
                reason => reason.to_string(),
            };
            format!("the {} {} {} nothing: {reason}", words[0], views.join(", "), words[1])
        };
        let parts: Vec<String> = unknown.map(part).collect();
        (!parts.is_empty()).then(|| Notice::EmptyImages(parts.join("; ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_named_with_options_that_a_sheet_has() {
        let mut views = EmptyViews::default();
        assert_eq!(views.summary(), None);
        views.add(EmptyReason::NoObjects, "top");
        assert_eq!(views.summary(), None, "a warning says that there is nothing to render");
        views.add(EmptyReason::NothingInView, "front");
        views.add(EmptyReason::NothingInView, "right");
        views.add(EmptyReason::NearPlane, "camera 1");
        assert_eq!(
            views.summary().map(|notice| notice.to_string()).unwrap_or_default(),
            "the view camera 1 shows nothing: the near plane cuts off everything in view; use `clip off`; the views front, \
             right show nothing: no object is seen from there, as flat ones from their edges"
        );
    }
}
