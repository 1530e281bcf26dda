//! The head of an HTTP request, and the checks that it has to pass before anything is served.

use std::io::Read;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::access::Access;
use super::token::Token;
use crate::args::{host_name, split_port};

/// Maximum size of a request's head in bytes.
const MAX_HEAD: usize = 16 << 10;
/// Maximum number of a request's header fields.
const MAX_FIELDS: usize = 64;
/// Time for a whole head.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest name of a host that an answer repeats, in bytes.
const MAX_SHOWN_HOST: usize = 100;

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

/// A refused request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    BadRequest,
    NotFound,
    MethodNotAllowed,
    /// A host that is not accepted, if its name is a plain one.
    Host(Option<String>),
    /// The host of a socket's origin that is not accepted, if its name is a plain one. The page knows the token.
    Origin(Option<String>),
    /// The path of a proxy before the token.
    Path,
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
    pub fn read(stream: &mut TcpStream, token: &Token, access: &Access) -> Result<Head, Refusal> {
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
            if let Some((request, length)) = parse(&bytes, token, access)? {
                return Ok(Head { request, rest: bytes.split_off(length) });
            }
            if bytes.len() > MAX_HEAD {
                return Err(Refusal::BadRequest);
            }
        }
    }
}

/// Parses and checks a head. Also returns its length; `None` if it is incomplete.
fn parse(bytes: &[u8], token: &Token, access: &Access) -> Result<Option<(Request, usize)>, Refusal> {
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
    let host = fields.single("host").ok_or(Refusal::NotFound)?;
    if !access.accepts_host(host) {
        return Err(Refusal::Host(shown_host(host)));
    }
    // The page requests neither absolute addresses nor ones with a query.
    let path = head.path.filter(|path| path.starts_with('/')).ok_or(Refusal::NotFound)?;
    let inner = access.inner_path(path);
    let (own_token, file) = inner.split_once('/').map_or((inner, None), |(token, file)| (token, Some(file)));
    if !token.matches(own_token) {
        let is_below = inner.split('/').any(|part| token.matches(part));
        return Err(if is_below { Refusal::Path } else { Refusal::NotFound });
    }
    let request = match file {
        None => Request::MissingSlash,
        Some("socket") => Request::Socket { key: socket_key(&fields, host, access)? },
        Some("") => Request::File("index.html".into()),
        Some(file) => Request::File(file.into()),
    };
    Ok(Some((request, length)))
}

/// The key of a WebSocket handshake from this server's own page.
fn socket_key(fields: &Fields, host: &str, access: &Access) -> Result<String, Refusal> {
    let single = |name: &str| fields.single(name).ok_or(Refusal::NotFound);
    let is_upgrade = single("upgrade")?.eq_ignore_ascii_case("websocket")
        && single("connection")?.split(',').any(|word| word.trim().eq_ignore_ascii_case("upgrade"))
        && single("sec-websocket-version")? == "13";
    let key = single("sec-websocket-key")?;
    let origin = single("origin")?;
    if !is_upgrade {
        return Err(Refusal::NotFound);
    }
    if !access.accepts_origin(origin, host) {
        let authority = origin.split_once("://").map_or("", |(_, authority)| authority);
        return Err(Refusal::Origin(shown_host(authority)));
    }
    Ok(key.into())
}

/// The name of a host without its port, if an answer may repeat it.
fn shown_host(host: &str) -> Option<String> {
    let (name, _) = split_port(host)?;
    host_name(name).ok().filter(|name| name.len() <= MAX_SHOWN_HOST)
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
        parse(head.as_bytes(), token, &Access::default()).map(|found| found.expect("the head is complete").0)
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
    fn foreign_hosts_and_paths_are_named() {
        let token = Token::random().unwrap();
        for (fields, refusal) in [
            ("", Refusal::NotFound),
            ("Host: localhost\r\nHost: localhost\r\n", Refusal::NotFound),
            ("Host: Example.org:80\r\n", Refusal::Host(Some("example.org".into()))),
            ("Host: <b>\r\n", Refusal::Host(None)),
            ("Host: \r\n", Refusal::Host(None)),
        ] {
            assert_eq!(ask(&token, &format!("GET /{token}/"), fields), Err(refusal), "{fields}");
        }
        let host = "Host: localhost\r\n";
        assert_eq!(ask(&token, &format!("GET /proxy/80/{token}/"), host), Err(Refusal::Path));
        assert_eq!(ask(&token, "GET /proxy/80/", host), Err(Refusal::NotFound));
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
        for (origin, host) in [
            ("http://localhost", Some("localhost")),
            ("http://127.0.0.1:7", Some("127.0.0.1")),
            ("https://localhost:7", Some("localhost")),
            ("null", None),
            ("http://example.org", Some("example.org")),
            ("http://a<b>", None),
        ] {
            let refused = Err(Refusal::Origin(host.map(String::from)));
            assert_eq!(open(&format!("Origin: {origin}\r\n")), refused, "{origin}");
        }
        assert_eq!(open(""), Err(Refusal::NotFound));
    }
}
