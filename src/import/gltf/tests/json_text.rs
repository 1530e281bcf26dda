//! JSON that displays nothing, or that is not quite JSON, does not make a file unreadable.

use serde_json::{Value, json};

use super::super::fixture::Fixture;

/// Loads a triangle with extras on its node; the text is any sequence of characters.
fn with_extras(text: &str) -> (usize, Vec<String>) {
    let mut fixture = Fixture::triangle();
    fixture.json["nodes"][0]["extras"] = json!("@");
    let (scene, warnings) =
        fixture.load_replaced("\"@\"", text).unwrap_or_else(|e| panic!("{text:.40}: {e}"));
    (scene.instanced_triangle_count() as usize, warnings)
}

#[test]
fn extras_that_the_parser_refuses_do_no_harm() {
    let deep = format!("{}1{}", "{\"a\":[".repeat(500_000), "]}".repeat(500_000));
    for text in [
        &*deep,
        r#"{"a":"\ud800","\udfff":"\ud83d \ud83d\ude00"}"#,
        "[1e400,-1E9999,{\"a\":1e999}]",
        "{\"path\":\"C:\\Users\\x\",\"text\":\"a\tb\n\"}",
        "[.5,+1,01,True,None,undefined,nan,-inf,1.#QNAN]",
    ] {
        let (triangles, warnings) = with_extras(text);
        assert_eq!(triangles, 1);
        assert!(warnings.len() == 1 || text.starts_with("[.5") && warnings.len() == 2, "{warnings:?}");
        assert!(warnings[0].starts_with("JSON, line 1 column "), "{warnings:?}");
    }
}

#[test]
fn valid_json_of_any_kind_in_extras_is_no_warning() {
    let wide = format!("[{}0]", "1,".repeat(10_000));
    for text in [
        r#"{"a":1,"a":2,"a":{"extensions":[null]}}"#,
        "123456789012345678901234567890123456789012345678901234567890",
        "-0.0e-999",
        "[null,{\"extensions\":5,\"weights\":[null]}]",
        "\"\\u0000\"",
        &*wide,
    ] {
        assert_eq!(with_extras(text), (1, Vec::new()), "{text:.60}");
    }
}

#[test]
fn deep_unknown_extensions_are_ignored() {
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"] = json!({"X_unknown": "@"});
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    let (scene, warnings) = fixture.load_replaced("\"@\"", &deep).unwrap();
    assert_eq!(scene.instanced_triangle_count(), 1);
    assert!(warnings[0].ends_with(": ignored 1 values nested deeper than 100 levels"), "{warnings:?}");
}

#[test]
fn invalid_members_without_influence_are_ignored() {
    type Edit = fn(&mut Value);
    let edits: [Edit; 14] = [
        |json| json["bufferViews"][0]["target"] = json!("ARRAY_BUFFER"),
        |json| json["samplers"] = json!([{"minFilter": "LINEAR", "magFilter": -1}]),
        |json| json["images"] = json!([{"uri": "a.png", "mimeType": 5}]),
        |json| json["skins"] = json!([{"joints": [0], "skeleton": "root"}]),
        |json| json["skins"] = json!([{"joints": [0], "skeleton": 1e12}]),
        |json| json["asset"]["minVersion"] = json!([2]),
        |json| json["extensions"] = json!("none"),
        |json| json["extensions"] = json!([]),
        |json| json["nodes"][0]["extensions"] = json!([]),
        |json| json["asset"]["extensions"] = json!(7),
        |json| json["extensionsUsed"] = json!("KHR_x"),
        |json| json["extensionsUsed"] = json!([1, {}, null]),
        |json| json["extensions"] = json!({"KHR_lights_punctual": [], "KHR_xmp": 3}),
        |json| json["meshes"][0]["primitives"][0]["extensions"] = json!(true),
    ];
    for (i, edit) in edits.iter().enumerate() {
        let mut fixture = Fixture::triangle();
        edit(&mut fixture.json);
        let (scene, _) = fixture.load();
        assert_eq!(scene.instanced_triangle_count(), 1, "{i}");
    }
}

#[test]
fn names_with_half_surrogates_are_shown_with_a_replacement_character() {
    let mut fixture = Fixture::triangle();
    fixture.json["nodes"][0]["name"] = json!("@");
    let (scene, warnings) = fixture.load_replaced("\"@\"", r#""a\ud800b\udc00""#).unwrap();
    assert_eq!((scene.objects[0].as_str(), warnings.len()), ("a\u{fffd}b\u{fffd}", 1));
}

#[test]
fn errors_after_a_repair_have_the_position_in_the_file() {
    let mut fixture = Fixture::triangle();
    fixture.json["extras"] = json!("@");
    let error = fixture.load_replaced("\"@\"", "[NaN,-Infinity,\nNaN,what]").map(|_| ()).unwrap_err();
    assert_eq!(error, "JSON, line 2 column 5: expected value");
}
