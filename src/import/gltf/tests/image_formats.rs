//! Images in formats that are not decoded.

use serde_json::{Value, json};

use super::materials::{base, base_texture, textured};

/// Images in formats that are not decoded are named. One that can be read, or a fallback, is shown.
#[test]
fn images_of_astc_avif_and_dds_are_named() {
    let mut astc = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    [157u32, 1, 4, 4].iter().for_each(|v| astc.extend(v.to_le_bytes()));
    astc.resize(160, 0);
    let formats = "PNG, JPEG, WebP, KTX2, BMP, TGA, TIFF or GIF";
    for (name, bytes, error) in [
        (
            "EXT_texture_astc",
            astc,
            "it is KTX2 with ASTC 4x4; save it as KTX2 with Basis Universal (ETC1S or UASTC), PNG or JPEG"
                .to_string(),
        ),
        (
            "EXT_texture_avif",
            b"\0\0\0\x20ftypavif\0\0\0\0avifmif1miaf".to_vec(),
            format!("AVIF images are not supported; save it as {formats}"),
        ),
        (
            "MSFT_texture_dds",
            [b"DDS |".to_vec(), vec![0; 200]].concat(),
            format!("DDS images are not supported; save it as {formats}"),
        ),
    ] {
        let mut fixture = textured(base());
        let view = fixture.view(&bytes);
        fixture.push("images", json!({"name": "brick", "bufferView": view}));
        let with = |texture: Value| {
            let mut fixture = fixture.clone();
            fixture.json["textures"][0] = texture;
            let (scene, warnings) = fixture.load();
            (base_texture(&scene).is_some(), warnings)
        };
        let ignored = format!("ignored {name}; used its fallback where there is one");
        let unreadable =
            format!("images[1]: image 'brick' cannot be decoded: {error}; used white (flat for normal maps)");
        let only = with(json!({"extensions": {name: {"source": 1}}}));
        assert_eq!(only, (false, vec![ignored.clone(), unreadable]), "{name}");
        let fallback = with(json!({"source": 0, "extensions": {name: {"source": 1}}}));
        assert_eq!(fallback, (true, vec![ignored.clone()]), "{name}");
        let misnamed = with(json!({"extensions": {name: {"source": 0}}}));
        assert_eq!(misnamed, (true, vec![ignored]), "{name}");
        fixture.json["extensionsRequired"] = json!([name]);
        let advice = "save the textures as PNG, JPEG, WebP or KTX2 with Basis Universal";
        let expected = format!("the file requires unsupported extensions: {name} ({advice})");
        assert!(fixture.error().ends_with(&expected), "{}", fixture.error());
    }
}
