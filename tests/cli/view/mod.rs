//! `blinn view` as a browser meets it, and as hosts meet it that should get nothing.

mod frames;
mod hostile;
mod lifetime;
mod reload;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Time after which a test fails rather than waits.
const PATIENCE: Duration = Duration::from_secs(100);

/// A running server.
struct Server {
    child: Child,
    url: String,
}

impl Server {
    /// Starts `blinn view` in a folder.
    fn start(folder: &Path, line: &str) -> Server {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .arg("view")
            .args(line.split_whitespace())
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();
        assert!(url.starts_with("http://127.0.0.1:"), "{url}");
        Server { child, url: url.trim().into() }
    }

    fn host(&self) -> &str {
        self.url.split('/').nth(2).unwrap()
    }

    fn token(&self) -> &str {
        self.url.split('/').nth(3).unwrap()
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.host()).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Sends a request as it is, and returns all of the answer.
    fn ask(&self, request: &str) -> String {
        let mut stream = self.connect();
        // The server may have closed it before all was written.
        let _ = stream.write_all(request.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn viewer(&self) -> Viewer {
        let mut request =
            format!("ws://{}/{}/socket", self.host(), self.token()).into_client_request().unwrap();
        let origin = format!("http://{}", self.host());
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        let (socket, _) = tungstenite::client(request, self.connect()).unwrap();
        let mut viewer = Viewer { socket, serial: 0, scene: Value::Null, command: Value::Null };
        viewer.scene = viewer.wait_for("scene");
        viewer
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page of the server.
struct Viewer {
    socket: WebSocket<TcpStream>,
    serial: u64,
    scene: Value,
    /// The last message about commands.
    command: Value,
}

/// A frame: its message and its bytes.
struct Frame {
    header: Value,
    bytes: Vec<u8>,
}

impl Viewer {
    /// The state at the start.
    fn view(&self) -> Value {
        self.scene["view"].clone()
    }

    fn send(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    fn read(&mut self) -> Message {
        self.socket.read().unwrap()
    }

    /// Reads up to the next message of a type. Bytes and others are skipped.
    fn wait_for(&mut self, kind: &str) -> Value {
        loop {
            if let Message::Text(text) = self.read() {
                let value: Value = serde_json::from_str(&text).unwrap();
                if value["type"] == "command" {
                    self.command = value.clone();
                }
                if value["type"] == kind {
                    return value;
                }
            }
        }
    }

    fn post(&mut self, view: &Value, size: [u32; 2], moving: bool) {
        self.serial += 1;
        let message = json!({"type": "view", "serial": self.serial, "moving": moving, "size": size, "pixel_ratio": 1, "view": view});
        self.send(&message);
    }

    /// Shows a state, and returns its frames up to the last.
    fn show(&mut self, view: &Value, size: [u32; 2]) -> Vec<Frame> {
        self.post(view, size, false);
        let mut frames = Vec::new();
        loop {
            let frame = self.next_frame();
            if frame.header["serial"] == self.serial {
                let is_final = frame.header["final"] == true;
                frames.push(frame);
                if is_final {
                    return frames;
                }
            }
        }
    }

    fn next_frame(&mut self) -> Frame {
        let header = self.wait_for("frame");
        let Message::Binary(bytes) = self.read() else { panic!("no bytes after {header}") };
        assert_eq!(header["bytes"], bytes.len());
        Frame { header, bytes: bytes.to_vec() }
    }
}

/// Runs a command of the page in a folder, and returns the picture that it writes.
fn run_command(folder: &Path, command: &str) -> Vec<u8> {
    let words = shlex::split(command).unwrap();
    assert_eq!(words[0], "blinn");
    let output =
        Command::new(env!("CARGO_BIN_EXE_blinn")).args(&words[1..]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    std::fs::read(folder.join(words.last().unwrap())).unwrap()
}
