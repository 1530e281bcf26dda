//! Addresses under which a proxy shows the page of `blinn view`.

/// Longest address in bytes.
const MAX_LENGTH: usize = 2000;

/// An address with scheme, host and path, such as `https://hub.example.org/user/ada/proxy/8080/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BaseUrl {
    /// Scheme, host and port as a browser sends them: `https://hub.example.org`.
    pub origin: String,
    /// The host without its port.
    pub host: String,
    /// The path, with a slash at both ends.
    pub path: String,
}

/// Parses an address.
pub fn base_url(text: &str) -> Result<BaseUrl, String> {
    let (scheme, rest) = text
        .split_once("://")
        .filter(|(scheme, _)| ["http", "https"].iter().any(|known| scheme.eq_ignore_ascii_case(known)))
        .ok_or("it has to start with https:// or http://")?;
    let (authority, path) = rest.split_once('/').unwrap_or((rest, ""));
    if text.len() > MAX_LENGTH {
        return Err(format!("it is longer than {MAX_LENGTH} characters"));
    }
    let is_plain = |c: char| c.is_ascii_graphic() && !"?#\"<>\\^`{|}".contains(c);
    if !path.chars().all(is_plain) {
        return Err("its path has a query, a fragment, or characters that an address does not have".into());
    }
    let (name, port) = split_port(authority).ok_or("its port is not a number up to 65535")?;
    let host = host_name(name)?;
    let scheme = scheme.to_ascii_lowercase();
    // Browsers leave out the port of the scheme.
    let usual = if scheme == "https" { 443 } else { 80 };
    let port = port.filter(|port| *port != usual).map(|port| format!(":{port}")).unwrap_or_default();
    let path = path.trim_matches('/');
    let path = if path.is_empty() { "/".into() } else { format!("/{path}/") };
    Ok(BaseUrl { origin: format!("{scheme}://{host}{port}"), host, path })
}

/// Parses the name of a host, without a port.
pub fn host_name(text: &str) -> Result<String, String> {
    let inside = text.strip_prefix('[').and_then(|text| text.strip_suffix(']'));
    let is_name = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
    let is_valid = match inside {
        Some(address) => address.parse::<std::net::Ipv6Addr>().is_ok(),
        None => !text.is_empty() && text.chars().all(is_name),
    };
    if !is_valid || text.len() > 253 {
        return Err("a host is a name such as hub.example.org, without https:// and without a port".into());
    }
    Ok(text.to_ascii_lowercase())
}

/// Splits `host` or `host:port`.
pub fn split_port(authority: &str) -> Option<(&str, Option<u16>)> {
    let end = authority.rfind(']').map_or(0, |end| end + 1);
    match authority[end..].find(':') {
        None => Some((authority, None)),
        Some(at) => {
            let (host, port) = authority.split_at(end + at);
            let port = &port[1..];
            if port.is_empty() { Some((host, None)) } else { Some((host, Some(port.parse().ok()?))) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_an_origin_and_a_path() {
        let parsed = |text: &str| base_url(text).map(|url| (url.origin, url.host, url.path));
        let expected = |origin: &str, host: &str, path: &str| Ok((origin.into(), host.into(), path.into()));
        assert_eq!(
            parsed("https://Hub.example.org/user/ada/proxy/8080"),
            expected("https://hub.example.org", "hub.example.org", "/user/ada/proxy/8080/")
        );
        assert_eq!(parsed("HTTP://a:80/"), expected("http://a", "a", "/"));
        assert_eq!(parsed("https://[::1]:8443"), expected("https://[::1]:8443", "[::1]", "/"));
        for text in [
            "",
            "hub.example.org",
            "ftp://a/",
            "https://",
            "https:///a",
            "https://a:x/",
            "https://a:99999/",
            "https://a/?b",
            "https://a/#b",
            "https://a b/",
            "https://a@b/",
            "https://a/\u{e9}",
            "https://a/\r\nb",
        ] {
            assert!(parsed(text).is_err(), "{text:?}");
        }
    }

    #[test]
    fn hosts_are_names_without_ports() {
        assert_eq!(host_name("A-8080.app.github.dev"), Ok("a-8080.app.github.dev".into()));
        assert_eq!(host_name("[::1]"), Ok("[::1]".into()));
        for text in ["", "a:80", "https://a", "a/b", "[::1", "*", "a b", &"a".repeat(254)] {
            assert!(host_name(text).is_err(), "{text}");
        }
    }
}
