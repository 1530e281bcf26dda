//! Answers to HTTP requests. Each ends its connection.

use std::io::{self, Write};
use std::net::TcpStream;

use super::page::PageFile;
use super::request::Refusal;

/// Fields of every answer: nothing is kept, embedded elsewhere, or loaded from elsewhere.
const FIELDS: &str = "\
Connection: close\r
Cache-Control: no-store\r
Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; \
connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r
Cross-Origin-Opener-Policy: same-origin\r
Cross-Origin-Resource-Policy: same-origin\r
Referrer-Policy: no-referrer\r
X-Content-Type-Options: nosniff\r
";

/// Sends a file of the page.
pub fn send_file(stream: &mut TcpStream, file: &PageFile) -> io::Result<()> {
    let PageFile { kind, text, .. } = file;
    let length = text.len();
    let head = format!("HTTP/1.1 200 OK\r\n{FIELDS}Content-Type: {kind}\r\nContent-Length: {length}\r\n\r\n");
    stream.write_all(head.as_bytes())?;
    stream.write_all(text.as_bytes())
}

/// Sends the browser to the same address with a slash at its end. `folder` is its last part: proxies may show the page
/// below another path.
pub fn add_slash(stream: &mut TcpStream, folder: &str) -> io::Result<()> {
    let head = format!(
        "HTTP/1.1 308 Permanent Redirect\r\n{FIELDS}Location: {folder}/\r\nContent-Length: 0\r\n\r\n"
    );
    stream.write_all(head.as_bytes())
}

/// Refuses a request. Only what a person behind a proxy has to change is said; the rest could disclose something.
pub fn refuse(stream: &mut TcpStream, refusal: &Refusal) -> io::Result<()> {
    let status = match refusal {
        Refusal::BadRequest => "400 Bad Request",
        Refusal::NotFound | Refusal::Path => "404 Not Found",
        Refusal::MethodNotAllowed => "405 Method Not Allowed",
        Refusal::Host(_) | Refusal::Origin(_) => "403 Forbidden",
        Refusal::Silent => return Ok(()),
    };
    let text = match refusal {
        Refusal::Host(Some(host)) => {
            format!("Start blinn view with --allow-host {host} to use it under this address.\n")
        }
        Refusal::Host(None) => "Start blinn view with --allow-host to use it under this address.\n".into(),
        Refusal::Path => "Start blinn view with --base-url, the address up to the token.\n".into(),
        _ => String::new(),
    };
    let kind = if text.is_empty() { "" } else { "Content-Type: text/plain; charset=utf-8\r\n" };
    let length = text.len();
    let head = format!("HTTP/1.1 {status}\r\n{FIELDS}{kind}Content-Length: {length}\r\n\r\n{text}");
    stream.write_all(head.as_bytes())
}

/// Accepts a WebSocket.
pub fn accept_socket(stream: &mut TcpStream, key: &str) -> io::Result<()> {
    let accept = tungstenite::handshake::derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())
}
