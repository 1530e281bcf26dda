//! The head of an HTTP request, and the checks that it has to pass before anything is served.

use std::io::Read;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::token::Token;

/// Maximum size of a request's head in bytes.
const MAX_HEAD: usize = 16 << 10;
/// Maximum number of a request's header fields.
const MAX_FIELDS: usize = 64;
/// Time for a whole head.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Names of this computer that browsers resolve without DNS.
const LOOPBACK_NAMES: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];

/// A request that passed all checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// The page, or a file of it by its name.
    File(String),
    /// The page's address without the slash at its end.
    MissingSlash,
    /// A WebSocket, with the key of its handshake.
    Socket { key: String },
}

/// The status of a refused request. It has no body, which could disclose something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    BadRequest,
    NotFound,
    MethodNotAllowed,
    /// The connection is closed without an answer.
    Silent,
}

/// A complete head, and the bytes that were read after it.
#[derive(Debug)]
pub struct Head {
    pub request: Request,
    pub rest: Vec<u8>,
}

impl Head {
    /// Reads the head of a request and checks it.
    pub fn read(stream: &mut TcpStream, token: &Token) -> Result<Head, Refusal> {
        let deadline = Instant::now() + HEAD_TIMEOUT;
        let mut bytes = Vec::new();
        let mut part = [0; 2048];
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || stream.set_read_timeout(Some(left)).is_err() {
                return Err(Refusal::Silent);
            }
            match stream.read(&mut part) {
                Ok(0) | Err(_) => return Err(Refusal::Silent),
                Ok(count) => bytes.extend_from_slice(&part[..count]),
            }
            if let Some((request, length)) = parse(&bytes, token)? {
                return Ok(Head { request, rest: bytes.split_off(length) });
            }
            if bytes.len() > MAX_HEAD {
                return Err(Refusal::BadRequest);
            }
        }
    }
}

/// Parses and checks a head. Also returns its length; `None` if it is incomplete.
fn parse(bytes: &[u8], token: &Token) -> Result<Option<(Request, usize)>, Refusal> {
    let mut fields = [httparse::EMPTY_HEADER; MAX_FIELDS];
    let mut head = httparse::Request::new(&mut fields);
    let length = match head.parse(bytes) {
        Ok(httparse::Status::Complete(length)) if length <= MAX_HEAD => length,
        Ok(httparse::Status::Partial) => return Ok(None),
        _ => return Err(Refusal::BadRequest),
    };
    if head.method != Some("GET") {
        return Err(Refusal::MethodNotAllowed);
    }
    let fields = Fields(head.headers);
    let host = fields.single("host").filter(|host| is_loopback(host)).ok_or(Refusal::NotFound)?;
    // The page requests neither absolute addresses nor ones with a query.
    let path = head.path.and_then(|path| path.strip_prefix('/')).ok_or(Refusal::NotFound)?;
    let (own_token, file) = path.split_once('/').map_or((path, None), |(token, file)| (token, Some(file)));
    if !token.matches(own_token) {
        return Err(Refusal::NotFound);
    }
    let request = match file {
        None => Request::MissingSlash,
        Some("socket") => Request::Socket { key: socket_key(&fields, host).ok_or(Refusal::NotFound)? },
        Some("") => Request::File("index.html".into()),
        Some(file) => Request::File(file.into()),
    };
    Ok(Some((request, length)))
}

/// The key of a WebSocket handshake from this server's own page.
fn socket_key(fields: &Fields, host: &str) -> Option<String> {
    // Another site's page may know the address, but cannot choose its origin.
    let origin = fields.single("origin")?;
    let is_own = origin.strip_prefix("http://").is_some_and(|origin| origin.eq_ignore_ascii_case(host));
    let is_upgrade = fields.single("upgrade")?.eq_ignore_ascii_case("websocket")
        && fields.single("connection")?.split(',').any(|word| word.trim().eq_ignore_ascii_case("upgrade"))
        && fields.single("sec-websocket-version")? == "13";
    let key = fields.single("sec-websocket-key")?;
    (is_own && is_upgrade).then(|| key.to_string())
}

/// True for a name of this computer with any port: ssh -L changes it.
fn is_loopback(host: &str) -> bool {
    let is_port = |port: &str| {
        port.is_empty() || port.strip_prefix(':').is_some_and(|port| port.parse::<u16>().is_ok())
    };
    LOOPBACK_NAMES.iter().any(|name| {
        let port = host.get(..name.len()).filter(|start| start.eq_ignore_ascii_case(name));
        port.is_some() && is_port(&host[name.len()..])
    })
}

/// Header fields.
struct Fields<'f>(&'f [httparse::Header<'f>]);

impl Fields<'_> {
    /// The value of a field that is there exactly once.
    fn single(&self, name: &str) -> Option<&str> {
        let mut all = self.0.iter().filter(|field| field.name.eq_ignore_ascii_case(name));
        let first = all.next()?;
        if all.next().is_some() { None } else { std::str::from_utf8(first.value).ok().map(str::trim) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(token: &Token, line: &str, fields: &str) -> Result<Request, Refusal> {
        let head = format!("{line} HTTP/1.1\r\n{fields}\r\n");
        parse(head.as_bytes(), token).map(|found| found.expect("the head is complete").0)
    }

    #[test]
    fn only_the_page_behind_the_token_is_served() {
        let token = Token::random().unwrap();
        let ask = |line: &str, fields: &str| ask(&token, &line.replace("TOKEN", &token.to_string()), fields);
        let host = "Host: localhost:8080\r\n";
        assert_eq!(ask("GET /TOKEN/", host), Ok(Request::File("index.html".into())));
        assert_eq!(ask("GET /TOKEN/view.css", host), Ok(Request::File("view.css".into())));
        assert_eq!(ask("GET /TOKEN", host), Ok(Request::MissingSlash));
        for line in ["GET /", "GET /TOKE/", "GET /index.html", "GET http://localhost/TOKEN/", "GET *"] {
            assert_eq!(ask(line, host), Err(Refusal::NotFound), "{line}");
        }
        for line in ["POST /TOKEN/", "HEAD /TOKEN/", "OPTIONS *", "get /TOKEN/"] {
            assert_eq!(ask(line, host), Err(Refusal::MethodNotAllowed), "{line}");
        }
    }

    #[test]
    fn hosts_are_names_of_this_computer_with_any_port() {
        for host in ["localhost", "localhost:1", "127.0.0.1:65535", "[::1]:80", "LocalHost:5"] {
            assert!(is_loopback(host), "{host}");
        }
        for host in [
            "",
            "example.org",
            "localhost.example.org",
            "127.0.0.1.nip.io",
            "localhost:x",
            "127.0.0.2",
            "localhost:99999",
        ] {
            assert!(!is_loopback(host), "{host}");
        }
        let token = Token::random().unwrap();
        for fields in ["", "Host: example.org\r\n", "Host: localhost\r\nHost: localhost\r\n"] {
            assert_eq!(ask(&token, &format!("GET /{token}/"), fields), Err(Refusal::NotFound), "{fields}");
        }
    }

    #[test]
    fn sockets_belong_to_the_own_origin() {
        let token = Token::random().unwrap();
        let open = |more: &str| {
            let fields = format!(
                "Host: localhost:7\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n\
                 Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n{more}"
            );
            ask(&token, &format!("GET /{token}/socket"), &fields)
        };
        assert!(matches!(open("Origin: http://localhost:7\r\n"), Ok(Request::Socket { .. })));
        for origin in
            ["http://localhost", "http://127.0.0.1:7", "https://localhost:7", "null", "http://example.org"]
        {
            assert_eq!(open(&format!("Origin: {origin}\r\n")), Err(Refusal::NotFound), "{origin}");
        }
        assert_eq!(open(""), Err(Refusal::NotFound));
    }
}
