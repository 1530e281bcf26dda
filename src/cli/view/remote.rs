//! Hints for opening the page from another computer, by what the environment says about this one.

/// Default domain of forwarded ports in GitHub Codespaces.
const CODESPACES_DOMAIN: &str = "app.github.dev";
/// Port of ssh.
const SSH_PORT: &str = "22";

/// Returns how to reach a port of this computer from the user's. `variable` reads the environment.
pub fn hint(port: u16, variable: impl Fn(&str) -> Option<String>) -> Option<String> {
    // Values are shown in a command that people copy.
    let plain = |name: &str| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-._:/%@~".contains(c);
        variable(name).filter(|value| !value.is_empty() && value.chars().all(is_plain))
    };
    if let Some(name) = plain("CODESPACE_NAME") {
        let domain = plain("GITHUB_CODESPACES_PORT_FORWARDING_DOMAIN");
        let domain = domain.as_deref().unwrap_or(CODESPACES_DOMAIN);
        return Some(format!(
            "in Codespaces, add --port {port} --base-url https://{name}-{port}.{domain}/ and open the address that is \
             printed then"
        ));
    }
    if let Some(prefix) = plain("JUPYTERHUB_SERVICE_PREFIX") {
        return Some(format!(
            "in JupyterHub with jupyter-server-proxy, add --port {port} --base-url https://HUB{}/proxy/{port}/, with the \
             hub's name for HUB, and open the address that is printed then",
            prefix.trim_end_matches('/')
        ));
    }
    let connection = variable("SSH_CONNECTION")?;
    // The client's address and port, then those of this computer.
    let parts: Vec<&str> = connection.split_whitespace().collect();
    let [_, _, address, ssh_port] = parts[..] else { return None };
    let is_address = address.parse::<std::net::IpAddr>().is_ok() && ssh_port.parse::<u16>().is_ok();
    let user = plain("USER").map(|user| format!("{user}@")).unwrap_or_default();
    let ssh_port = if ssh_port == SSH_PORT { String::new() } else { format!("-p {ssh_port} ") };
    is_address.then(|| {
        format!(
            "over ssh, run this on your own computer and open the address there: ssh -N {ssh_port}-L \
             {port}:localhost:{port} {user}{address}"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hint_of(variables: &[(&str, &str)]) -> Option<String> {
        hint(8080, |name| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| value.to_string())
        })
    }

    #[test]
    fn commands_name_this_computer() {
        assert_eq!(hint_of(&[("USER", "ada")]), None);
        let ssh = |connection: &str| hint_of(&[("USER", "ada"), ("SSH_CONNECTION", connection)]);
        let command = ssh("10.0.0.9 51000 10.0.0.5 22").unwrap();
        assert!(command.ends_with(": ssh -N -L 8080:localhost:8080 ada@10.0.0.5"), "{command}");
        let command = ssh("::1 51000 fe80::1 2222").unwrap();
        assert!(command.ends_with(": ssh -N -p 2222 -L 8080:localhost:8080 ada@fe80::1"), "{command}");
        for broken in ["", "a b c d", "1.2.3.4 5", "1.2.3.4 5 $(x) 22", "1.2.3.4 5 1.2.3.4 22;x"] {
            assert_eq!(ssh(broken), None, "{broken}");
        }
        let hub = hint_of(&[("JUPYTERHUB_SERVICE_PREFIX", "/user/ada/")]).unwrap();
        assert!(hub.contains("--base-url https://HUB/user/ada/proxy/8080/"), "{hub}");
        let space = hint_of(&[("CODESPACE_NAME", "odd-robot-x7")]).unwrap();
        assert!(space.contains("--base-url https://odd-robot-x7-8080.app.github.dev/"), "{space}");
        assert_eq!(hint_of(&[("CODESPACE_NAME", "$(reboot)")]), None);
    }
}
