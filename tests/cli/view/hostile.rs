//! Requests that get nothing, and connections that delay nobody.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::json;
use tungstenite::client::IntoClientRequest;

use super::{PATIENCE, Server};
use crate::common::program::*;

fn cube() -> (tempfile::TempDir, Server) {
    let (dir, path) = folder();
    (dir, Server::start(&path, &model("tests/cube.obj")))
}

#[test]
fn the_page_is_served_with_its_policy() {
    let (_dir, server) = cube();
    let get = |file: &str| {
        let (host, token) = (server.host(), server.token());
        server.ask(&format!("GET /{token}/{file} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
    };
    for (file, kind) in [
        ("", "text/html"),
        ("main.js", "text/javascript"),
        ("view.css", "text/css"),
        ("style.css", "text/css"),
    ] {
        let answer = get(file);
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{file}");
        for field in [&format!("Content-Type: {kind}")[..], "default-src 'none'", "no-store", "nosniff"] {
            assert!(answer.contains(field), "{file}: {field}");
        }
    }
    // The page needs nothing from elsewhere.
    assert!(!get("").contains("http://") && !get("").contains("https://"));
}

#[test]
fn other_requests_get_nothing() {
    let (_dir, server) = cube();
    let (host, token) = (server.host().to_string(), server.token().to_string());
    let wrong = format!("{}{}", if token.starts_with('0') { '1' } else { '0' }, &token[1..]);
    let long = "x".repeat(40_000);
    for (line, own_host, status) in [
        ("GET / HTTP/1.1".to_string(), host.clone(), "404"),
        (format!("GET /{wrong}/ HTTP/1.1"), host.clone(), "404"),
        (format!("GET /{}/ HTTP/1.1", &token[1..]), host.clone(), "404"),
        (format!("GET /{token}/../../etc/passwd HTTP/1.1"), host.clone(), "404"),
        (format!("GET /{token}/%2e%2e/%2e%2e/Cargo.toml HTTP/1.1"), host.clone(), "404"),
        (format!("GET /{token}//etc/passwd HTTP/1.1"), host.clone(), "404"),
        (format!("GET /{token}/main.js/ HTTP/1.1"), host.clone(), "404"),
        (format!("GET /{token}/index.html? HTTP/1.1"), host.clone(), "404"),
        (format!("GET /{token}/socket HTTP/1.1"), host.clone(), "404"),
        (format!("POST /{token}/ HTTP/1.1"), host.clone(), "405"),
        ("CONNECT example.org:80 HTTP/1.1".to_string(), host.clone(), "405"),
        (format!("GET /{token}/ HTTP/1.1\r\nX: {long}"), host.clone(), "400"),
        (format!("GET /{token}/\0 HTTP/1.1"), host.clone(), "400"),
        ("nonsense".into(), host.clone(), "400"),
    ] {
        let answer = server.ask(&format!("{line}\r\nHost: {own_host}\r\n\r\n"));
        let shown = &line[..line.len().min(80)];
        // A peer that is still sending when it is refused may see the connection end without the answer.
        let is_cut = status == "400" && answer.is_empty();
        assert!(is_cut || answer.starts_with(&format!("HTTP/1.1 {status} ")), "{shown}: {answer}");
        assert!(is_cut || answer.ends_with("\r\nContent-Length: 0\r\n\r\n"), "{shown}: {answer}");
        assert!(!answer.contains(&token), "{shown}");
    }
}

/// A refused host is told which flag accepts it, and nothing else.
#[test]
fn other_hosts_are_told_the_flag() {
    let (_dir, server) = cube();
    let token = server.token();
    for (line, host, text) in [
        (
            format!("GET /{token}/ HTTP/1.1"),
            "hub.example.org:80",
            "Start blinn view with --allow-host hub.example.org to",
        ),
        ("GET / HTTP/1.1".into(), "127.0.0.1.example.org", "--allow-host 127.0.0.1.example.org to"),
        (format!("GET /{token}/ HTTP/1.1"), "<script>", "Start blinn view with --allow-host to use"),
        (format!("GET /proxy/80/{token}/ HTTP/1.1"), server.host(), "Start blinn view with --base-url, "),
    ] {
        let answer = server.ask(&format!("{line}\r\nHost: {host}\r\n\r\n"));
        let status = if text.contains("base-url") { "404" } else { "403" };
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")) && answer.contains(text), "{answer}");
        assert!(answer.contains("Content-Type: text/plain") && answer.contains("nosniff"), "{answer}");
        assert!(
            !answer.contains(token) && !answer.contains("cube") && !answer.contains("<script>"),
            "{answer}"
        );
    }
}

/// Behind a proxy that keeps its path, and behind one that removes it.
#[test]
fn proxies_that_flags_name_are_answered() {
    let (_dir, path) = folder();
    let scene = model("tests/cube.obj");
    let base = "https://hub.example.org/user/ada/proxy/8080/";
    let port = TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port();
    let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(["view", &scene, "--base-url", base, "--allow-host", "a-80.app.github.dev", "--port"])
        .arg(port.to_string())
        .current_dir(&path)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut url = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();
    let token =
        url.trim().strip_prefix(base).and_then(|rest| rest.strip_suffix('/')).expect(&url).to_string();
    let server = Server { child, url: format!("http://127.0.0.1:{port}/{token}/") };
    for (path, host) in [
        (format!("/user/ada/proxy/8080/{token}/"), "hub.example.org"),
        (format!("/{token}/main.js"), "hub.example.org:443"),
        (format!("/{token}/"), "a-80.app.github.dev"),
        (format!("/{token}/"), "localhost"),
    ] {
        let answer = server.ask(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"));
        assert!(answer.starts_with("HTTP/1.1 200 "), "{path} {host}: {answer}");
    }
    let answer =
        server.ask(&format!("GET /user/ada/proxy/8080/{token} HTTP/1.1\r\nHost: hub.example.org\r\n\r\n"));
    assert!(answer.contains(&format!("\r\nLocation: {token}/\r\n")), "{answer}");
    for (origin, host, status) in [
        ("https://hub.example.org", "hub.example.org", "101"),
        ("https://a-80.app.github.dev", "localhost:80", "101"),
        ("https://hub.example.com", "hub.example.org", "403"),
        ("http://hub.example.org", "localhost:80", "403"),
    ] {
        let mut stream = server.connect();
        let head = format!(
            "GET /{token}/socket HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nUpgrade: websocket\r\n\
             Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).unwrap();
        let mut start = [0; 12];
        stream.read_exact(&mut start).unwrap();
        assert_eq!(&start[9..], status.as_bytes(), "{origin} {host}");
    }
}

#[test]
fn sockets_of_other_origins_are_refused() {
    let (_dir, server) = cube();
    let own = format!("http://{}", server.host());
    let port = server.host().rsplit(':').next().unwrap();
    let open = |origin: Option<&str>, token: &str| {
        let mut request = format!("ws://{}/{token}/socket", server.host()).into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        tungstenite::client(request, server.connect()).is_ok()
    };
    let token = server.token();
    assert!(open(Some(&own), token));
    for origin in [
        "http://example.org",
        "null",
        &format!("http://localhost:{port}"),
        &own.replace("http", "https"),
        "http://127.0.0.1",
    ] {
        assert!(!open(Some(origin), token), "{origin}");
    }
    assert!(!open(None, token) && !open(Some(&own), &token.replace(|c: char| c != '0', "0")));
}

/// A viewer that does not read gets no more frames, and others get theirs.
#[test]
fn a_viewer_that_does_not_read_delays_nobody() {
    let (_dir, server) = cube();
    let mut slow = server.viewer();
    let view = slow.view();
    let noisy =
        json!({"camera": view["camera"], "lights": "three-point", "samples": 1, "background": "transparent"});
    for _ in 0..40 {
        slow.post(&noisy, [1200, 1200], false);
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut other = server.viewer();
    for _ in 0..3 {
        let frames = other.show(&view, [64, 48]);
        assert_eq!(frames.last().unwrap().header["final"], true);
    }
}

/// Connections that send nothing give way to those that know the token, and end by themselves.
#[test]
fn silent_connections_delay_nobody() {
    let (_dir, server) = cube();
    let mut silent: Vec<TcpStream> = (0..300).map(|_| server.connect()).collect();
    for stream in silent.iter_mut().skip(100) {
        // A head that never ends.
        let _ = stream.write_all(b"GET / HTTP/1.1\r\nHost: ");
    }
    let mut viewer = server.viewer();
    let view = viewer.view();
    assert!(!viewer.show(&view, [64, 48]).is_empty());
    let last = silent.last_mut().unwrap();
    last.set_read_timeout(Some(PATIENCE)).unwrap();
    assert!(matches!(last.read(&mut [0; 1]), Ok(0) | Err(_)), "it is closed after some seconds");
}

/// Messages that are too long end the connection of their sender alone.
#[test]
fn long_and_broken_messages_harm_nobody() {
    let (_dir, server) = cube();
    let mut other = server.viewer();
    let view = other.view();
    let mut sender = server.viewer();
    let _ = sender.socket.send(tungstenite::Message::text("[".repeat(100_000)));
    sender.wait_for("error");
    let _ = sender.socket.send(tungstenite::Message::text(" ".repeat(5 << 20)));
    while sender.socket.read().is_ok() {}
    let mut broken = server.viewer();
    // A frame without a mask, and noise.
    broken.socket.get_mut().write_all(&[0x81, 0x05, 1, 2, 3, 4, 5, 0xff, 0xff, 0xff]).unwrap();
    while broken.socket.read().is_ok() {}
    // A picture that no memory holds is refused.
    other.post(&view, [u32::MAX, u32::MAX], false);
    other.wait_for("error");
    assert!(!other.show(&view, [64, 48]).is_empty());
}
