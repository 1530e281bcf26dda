//! Messages without the numbers that operating systems give their errors.

/// Returns a message without ` (os error 2)`, which follows the words for the same.
pub fn without_error_codes(text: &str) -> String {
    const MARK: &str = " (os error ";
    let mut parts = text.split(MARK);
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        match part.split_once(')') {
            Some((code, rest)) if code.parse::<i32>().is_ok() => out += rest,
            _ => {
                out += MARK;
                out += part;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_codes_are_left_out_wherever_they_stand() {
        let text = "a.glb: No such file or directory (os error 2); b.png: Permission denied (os error 13)";
        assert_eq!(without_error_codes(text), "a.glb: No such file or directory; b.png: Permission denied");
        for kept in ["plain", "(os error 2)", "x (os error two)", "x (os error 2"] {
            assert_eq!(without_error_codes(kept), kept);
        }
    }
}
