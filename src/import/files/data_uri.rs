//! Data URIs (RFC 2397).

/// Decodes a URI that starts with `data:` in any letter case to at most `limit` bytes.
///
/// # Errors
/// The URI is malformed or its content is larger than `limit`.
pub(crate) fn decode(uri: &str, limit: u64) -> Result<Vec<u8>, String> {
    let refuse = |error: String| format!("the data URI {error}");
    if uri.len() as u64 / 4 * 3 > limit {
        return Err(refuse(format!("is larger than the limit of {limit} bytes")));
    }
    let uri = format!("data:{}", &uri[5..]);
    // Some exporters write the URL-safe alphabet of base64.
    let url_safe =
        || (uri.contains(['-', '_'])).then(|| bytes(&uri.replace('-', "+").replace('_', "/")).ok())?;
    bytes(&uri).or_else(|error| url_safe().ok_or_else(|| refuse(error)))
}

fn bytes(uri: &str) -> Result<Vec<u8>, String> {
    let parsed = data_url::DataUrl::process(uri).map_err(|e| format!("is malformed: {e:?}"))?;
    let (bytes, _) = parsed.decode_to_vec().map_err(|e| format!("is not base64: {e}"))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_alphabets_of_base64_and_plain_text_are_decoded() {
        for (uri, bytes) in [
            ("DATA:;base64,aGk =", &b"hi"[..]),
            ("data:application/octet-stream;base64,-_8=", &[0xfb, 0xff]),
            ("data:application/octet-stream;base64,+/8", &[0xfb, 0xff]),
            ("data:,h-i_%20", b"h-i_ "),
        ] {
            assert_eq!(decode(uri, 100).unwrap(), bytes, "{uri}");
        }
        assert_eq!(decode("data:nothing", 100).unwrap_err(), "the data URI is malformed: NoComma");
        assert!(decode("data:;base64,a*", 100).unwrap_err().starts_with("the data URI is not base64: "));
        assert!(decode(&format!("data:,{}", "x".repeat(200)), 100).unwrap_err().contains("limit of 100"));
    }
}
