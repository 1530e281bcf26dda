//! The WebSocket of a viewer: reads its states and picks, and writes what waits for it. One thread does both, so that a
//! viewer that reads slowly delays nothing but itself.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Bytes, Error, Message, WebSocket};

use super::hub::{Hub, ViewerId};
use super::messages::{self, PageMessage};
use super::outbox::{Outbox, Outgoing};

/// Longest message of a page in bytes: a list of all hidden objects of a large scene.
const MAX_MESSAGE: usize = 4 << 20;
/// Time between checks for messages to send, while a frame is rendered and otherwise.
const BUSY_PAUSE: Duration = Duration::from_millis(3);
const IDLE_PAUSE: Duration = Duration::from_millis(50);
/// Time without a message after which the viewer is pinged, and then disconnected.
const PING_AFTER: Duration = Duration::from_secs(20);
const GONE_AFTER: Duration = Duration::from_secs(60);

/// Serves a viewer until it leaves. `rest` was read after the handshake.
pub fn run(stream: TcpStream, rest: Vec<u8>, hub: &Arc<Hub>) {
    let config = WebSocketConfig::default()
        .read_buffer_size(16 << 10)
        .write_buffer_size(0)
        .max_message_size(Some(MAX_MESSAGE))
        .max_frame_size(Some(MAX_MESSAGE));
    let outbox = Arc::new(Outbox::default());
    let membership = Membership { hub, id: hub.join(outbox.clone()) };
    let socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    // An error is the end of the connection, which its peer knows.
    let _ = Viewer { socket, outbox, membership, heard: Instant::now(), pinged: false }.serve();
}

/// A viewer's place among all, which it leaves with its thread.
struct Membership<'h> {
    hub: &'h Arc<Hub>,
    id: ViewerId,
}

impl Drop for Membership<'_> {
    fn drop(&mut self) {
        self.hub.leave(self.id);
    }
}

struct Viewer<'h> {
    socket: WebSocket<TcpStream>,
    outbox: Arc<Outbox>,
    membership: Membership<'h>,
    /// The time of the last message.
    heard: Instant,
    pinged: bool,
}

impl Viewer<'_> {
    fn serve(&mut self) -> Result<(), Error> {
        loop {
            while let Some(message) = self.outbox.take() {
                self.send(message)?;
            }
            self.check_presence()?;
            let is_busy = self.membership.hub.is_busy(self.membership.id);
            let pause = if is_busy { BUSY_PAUSE } else { IDLE_PAUSE };
            self.socket.get_ref().set_read_timeout(Some(pause))?;
            match self.socket.read() {
                Ok(message) => {
                    self.heard = Instant::now();
                    self.pinged = false;
                    self.receive(&message);
                }
                Err(Error::Io(error)) if is_timeout(error.kind()) => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn send(&mut self, message: Outgoing) -> Result<(), Error> {
        match message {
            Outgoing::Text(text) => self.socket.send(Message::text(text)),
            Outgoing::Frame(frame) => {
                self.socket.send(Message::text(frame.header))?;
                self.socket.send(Message::Binary(Bytes::from(frame.bytes)))
            }
        }
    }

    /// Pings a silent peer, and ends the connection of one that is gone.
    fn check_presence(&mut self) -> Result<(), Error> {
        let silence = self.heard.elapsed();
        if silence >= GONE_AFTER {
            return Err(Error::ConnectionClosed);
        }
        if silence >= PING_AFTER && !self.pinged {
            self.pinged = true;
            self.socket.send(Message::Ping(Bytes::new()))?;
        }
        Ok(())
    }

    fn receive(&mut self, message: &Message) {
        let Message::Text(text) = message else { return };
        let Membership { hub, id } = &self.membership;
        match parse(text) {
            Ok(PageMessage::View(view)) => hub.show(*id, *view),
            Ok(PageMessage::Pick(pick)) => hub.pick(*id, pick),
            Ok(PageMessage::Open(open)) => hub.open(open.file),
            Err(error) => {
                self.outbox.error(messages::error(&format!("the message cannot be read: {error}")).into())
            }
        }
    }
}

/// Parses a message. In the view, null stands for a default.
fn parse(text: &str) -> serde_json::Result<PageMessage> {
    let mut value: Value = serde_json::from_str(text)?;
    if let Some(view) = value.get_mut("view").and_then(Value::as_object_mut) {
        view.retain(|_, value| !value.is_null());
    }
    serde_json::from_value(value)
}

fn is_timeout(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::state::{CameraState, ExposureState};

    #[test]
    fn null_and_missing_fields_are_defaults() {
        let text = r#"{"type":"view","serial":3,"size":[64,48],"view":
            {"camera":{"kind":"file","index":1},"exposure":null,"ao":null,"animation":null,"more":1}}"#;
        let Ok(PageMessage::View(message)) = parse(text) else { panic!("another message") };
        assert_eq!((message.serial, message.moving, message.size), (3, false, (64, 48)));
        assert_eq!(message.view.camera, CameraState::File { index: 1 });
        assert_eq!(message.view.exposure, ExposureState::Named("auto".into()));
        assert_eq!((message.view.ao, message.view.samples, message.view.animation), (0, 4, None));
    }

    #[test]
    fn broken_messages_are_errors() {
        for text in ["", "{}", "[]", "{\"type\":\"exit\"}", "{\"type\":\"pick\"}", &"[".repeat(100_000)] {
            assert!(parse(text).is_err());
        }
    }
}
