//! The secret in the address of the page.

use std::fmt;

use anyhow::{Result, anyhow};

/// Random bytes of a token: 128 bits.
const TOKEN_BYTES: usize = 16;

/// A secret that only those know who were given the address.
#[derive(Clone)]
pub struct Token(String);

impl Token {
    /// A new token from the system's random numbers.
    ///
    /// # Errors
    /// The system has none.
    pub fn random() -> Result<Token> {
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes).map_err(|e| anyhow!("no random numbers: {e}"))?;
        Ok(Token(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Compares in a time that does not depend on the place of the first difference.
    pub fn matches(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        own.len() == other.len() && own.iter().zip(other).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
    }
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_match_only_themselves() {
        let (a, b) = (Token::random().unwrap(), Token::random().unwrap());
        assert_eq!(a.to_string().len(), 2 * TOKEN_BYTES);
        assert!(a.matches(&a.to_string()) && !a.matches(&b.to_string()));
        assert!(!a.matches("") && !a.matches(&a.to_string()[1..]) && !a.matches(&format!("{a}0")));
    }
}
