//! Messages that wait to be sent to a viewer: the newest of each kind, so that a slow viewer costs no more than one picture.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

/// Maximum number of waiting answers to picks.
const MAX_PICKED: usize = 8;

/// Messages that wait to be sent to a viewer.
#[derive(Default)]
pub struct Outbox(Mutex<Waiting>);

#[derive(Default)]
struct Waiting {
    scene: Option<Arc<str>>,
    status: Option<Arc<str>>,
    error: Option<Arc<str>>,
    command: Option<String>,
    frame: Option<FrameMessage>,
    picked: VecDeque<String>,
}

/// A frame: the message before it, and its bytes.
pub struct FrameMessage {
    pub header: String,
    pub bytes: Vec<u8>,
}

/// A message to send.
pub enum Outgoing {
    Text(String),
    Frame(FrameMessage),
}

impl Outbox {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// A scene. What waits belongs to the one before.
    pub fn scene(&self, text: Arc<str>) {
        *self.lock() = Waiting { scene: Some(text), ..Waiting::default() };
    }

    pub fn status(&self, text: Arc<str>) {
        self.lock().status = Some(text);
    }

    pub fn error(&self, text: Arc<str>) {
        self.lock().error = Some(text);
    }

    pub fn command(&self, text: String) {
        self.lock().command = Some(text);
    }

    pub fn frame(&self, frame: FrameMessage) {
        self.lock().frame = Some(frame);
    }

    pub fn picked(&self, text: String) {
        let mut waiting = self.lock();
        if waiting.picked.len() < MAX_PICKED {
            waiting.picked.push_back(text);
        }
    }

    /// Takes the next message.
    pub fn take(&self) -> Option<Outgoing> {
        let mut waiting = self.lock();
        let shared = |text: Arc<str>| Outgoing::Text(text.to_string());
        let waiting = &mut *waiting;
        let text =
            [&mut waiting.scene, &mut waiting.status, &mut waiting.error].into_iter().find_map(Option::take);
        text.map(shared)
            .or_else(|| waiting.picked.pop_front().map(Outgoing::Text))
            .or_else(|| waiting.command.take().map(Outgoing::Text))
            .or_else(|| waiting.frame.take().map(Outgoing::Frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_of_each_kind_waits() {
        let outbox = Outbox::default();
        for i in 0..100 {
            outbox.frame(FrameMessage { header: i.to_string(), bytes: vec![0; 10] });
            outbox.command(i.to_string());
            outbox.picked(i.to_string());
        }
        let mut texts = Vec::new();
        let mut frames = Vec::new();
        while let Some(message) = outbox.take() {
            match message {
                Outgoing::Text(text) => texts.push(text),
                Outgoing::Frame(frame) => frames.push(frame.header),
            }
        }
        assert_eq!(texts, ["0", "1", "2", "3", "4", "5", "6", "7", "99"]);
        assert_eq!(frames, ["99"]);
    }

    #[test]
    fn a_new_scene_discards_what_belongs_to_the_old_one() {
        let outbox = Outbox::default();
        outbox.command("old".into());
        outbox.scene("new".into());
        assert!(matches!(outbox.take(), Some(Outgoing::Text(text)) if text == "new"));
        assert!(outbox.take().is_none());
    }
}
