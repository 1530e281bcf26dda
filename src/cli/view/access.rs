//! The hosts and origins that the page answers for: this computer's, and those of proxies that flags name.

use crate::args::{BaseUrl, split_port};

/// Names of this computer that browsers resolve without DNS.
const LOOPBACK_NAMES: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];

/// The hosts and origins that are accepted.
#[derive(Clone, Debug, Default)]
pub struct Access {
    pub base_url: Option<BaseUrl>,
    /// Names of hosts in lower case, without ports.
    pub hosts: Vec<String>,
}

impl Access {
    /// True for a name of this computer or of a proxy, with any port: `ssh -L` changes it.
    pub fn accepts_host(&self, host: &str) -> bool {
        split_port(host).is_some_and(|(name, _)| is_loopback(name) || self.is_named(name))
    }

    /// True for the origin of a page at `host`, or at a proxy. Another site's page may know the address, but cannot
    /// choose its origin.
    pub fn accepts_origin(&self, origin: &str, host: &str) -> bool {
        let Some((scheme, authority)) = origin.split_once("://") else { return false };
        if scheme == "http" && authority.eq_ignore_ascii_case(host) {
            return true;
        }
        let is_base = |base: &BaseUrl| origin.eq_ignore_ascii_case(&base.origin);
        let is_allowed = |(name, _)| self.hosts.iter().any(|host| host.eq_ignore_ascii_case(name));
        self.base_url.as_ref().is_some_and(is_base)
            || ["http", "https"].contains(&scheme) && split_port(authority).is_some_and(is_allowed)
    }

    /// The path below that of the proxy, which may have removed its own.
    pub fn inner_path<'p>(&self, path: &'p str) -> &'p str {
        let base = self.base_url.as_ref().map_or("/", |base| &base.path);
        path.strip_prefix(base).or_else(|| path.strip_prefix('/')).unwrap_or(path)
    }

    fn is_named(&self, name: &str) -> bool {
        let base = self.base_url.iter().map(|base| &base.host);
        self.hosts.iter().chain(base).any(|host| host.eq_ignore_ascii_case(name))
    }
}

fn is_loopback(name: &str) -> bool {
    LOOPBACK_NAMES.iter().any(|known| known.eq_ignore_ascii_case(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::values::base_url;

    #[test]
    fn hosts_are_names_of_this_computer_with_any_port() {
        let own = Access::default();
        for host in ["localhost", "localhost:1", "127.0.0.1:65535", "[::1]:80", "LocalHost:5"] {
            assert!(own.accepts_host(host), "{host}");
        }
        for host in [
            "",
            "example.org",
            "localhost.example.org",
            "127.0.0.1.nip.io",
            "localhost:x",
            "127.0.0.2",
            "localhost:99999",
            "[::1",
        ] {
            assert!(!own.accepts_host(host), "{host}");
        }
    }

    #[test]
    fn proxies_are_accepted_by_name() {
        let base_url = base_url("https://hub.example.org/user/ada/proxy/8080").unwrap();
        let access = Access { base_url: Some(base_url), hosts: vec!["a-80.app.github.dev".into()] };
        for host in ["hub.example.org", "Hub.Example.org:443", "a-80.app.github.dev", "localhost:8080"] {
            assert!(access.accepts_host(host), "{host}");
        }
        for host in ["example.org", "b-80.app.github.dev", "hub.example.org.example.com"] {
            assert!(!access.accepts_host(host), "{host}");
        }
        for origin in ["https://hub.example.org", "https://a-80.app.github.dev", "http://localhost:8080"] {
            assert!(access.accepts_origin(origin, "localhost:8080"), "{origin}");
        }
        for origin in [
            "http://hub.example.org",
            "https://hub.example.org:444",
            "https://example.org",
            "null",
            "https://localhost:8080",
            "file://a-80.app.github.dev",
        ] {
            assert!(!access.accepts_origin(origin, "localhost:8080"), "{origin}");
        }
        for (path, inner) in
            [("/user/ada/proxy/8080/t/a.js", "t/a.js"), ("/t/a.js", "t/a.js"), ("/user/eve/", "user/eve/")]
        {
            assert_eq!(access.inner_path(path), inner);
        }
    }
}
