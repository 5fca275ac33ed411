//! docs/cell.md and the JSON schema name every key of cell.toml, block by block, and no other.

use serde_json::Value;
use shared_mem::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The keys under each heading of the document: those in the first column of its table.
fn documented() -> BTreeMap<String, BTreeSet<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/cell.md");
    let text = std::fs::read_to_string(path).expect("docs/cell.md");
    let (mut found, mut block) = (BTreeMap::<String, BTreeSet<String>>::new(), None);
    for line in text.lines() {
        if let Some(heading) = line.strip_prefix("## `").or(line.strip_prefix("### `")) {
            block = Some(heading.trim_end_matches('`').to_owned());
        } else if let (Some(block), Some(row)) = (&block, line.strip_prefix("| `")) {
            found.entry(block.clone()).or_default().insert(row.split('`').next().unwrap_or("").to_owned());
        }
    }
    found
}

/// The keys that the reader knows in a block, as it says when it meets one that it does not.
fn known(block: &str) -> BTreeSet<String> {
    let error =
        Cell::parse(&format!("{block}\nzzzz = 1\n"), Path::new("cell.toml")).expect_err("no such key").to_string();
    let names = error.split_once("known here: ").unwrap_or_else(|| panic!("{block}: {error}")).1;
    names.split(", ").map(str::to_owned).collect()
}

#[test]
fn every_key_stands_in_the_document_and_every_key_of_the_document_exists() {
    let documented = documented();
    let blocks: BTreeSet<String> = documented
        .keys()
        .filter(|block| !block.contains('.'))
        .map(|block| block.trim_matches(['[', ']']).to_owned())
        .collect();
    assert_eq!(known(""), blocks, "blocks of cell.toml");
    for (block, keys) in &documented {
        assert_eq!(&known(block), keys, "keys of {block}");
    }
    // The tables within a block have headings of their own.
    for within in ["[object.pose_noise]", "[camera.intrinsics]", "[camera.pose]", "[wrench.noise]"] {
        assert!(documented.contains_key(within), "{within}");
    }
}

/// The first thing in `value` that a JSON schema does not allow; of the schema what `schemars` writes for the types of cell.toml.
fn refused(root: &Value, schema: &Value, value: &Value, at: &str) -> Option<String> {
    if let Some(name) = schema["$ref"].as_str().and_then(|path| path.strip_prefix("#/$defs/")) {
        return refused(root, &root["$defs"][name], value, at);
    }
    if let Some(several) = schema["anyOf"].as_array().or(schema["oneOf"].as_array()) {
        let all: Vec<String> = several.iter().filter_map(|one| refused(root, one, value, at)).collect();
        return if all.len() < several.len() { None } else { Some(all.join(" and ")) };
    }
    let is = |kind: &str| match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "null" => value.is_null(),
        other => panic!("{at}: the type {other} is not looked at"),
    };
    let kinds = match &schema["type"] {
        Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
        kind => vec![kind.as_str().unwrap_or_else(|| panic!("{at}: no type in {schema}"))],
    };
    let constant = schema.get("const").or(schema.get("enum").and_then(|list| list.as_array()?.first()));
    if !kinds.iter().any(|kind| is(kind)) || constant.is_some_and(|constant| constant != value) {
        return Some(format!("{at}: {value} is no {}", constant.map_or(kinds.join(" or "), Value::to_string)));
    }
    if let Some(list) = value.as_array() {
        let bound = |key: &str, otherwise: u64| schema[key].as_u64().unwrap_or(otherwise);
        if !(bound("minItems", 0)..=bound("maxItems", u64::MAX)).contains(&(list.len() as u64)) {
            return Some(format!("{at}: {} items", list.len()));
        }
        return list.iter().find_map(|item| refused(root, &schema["items"], item, at));
    }
    let object = value.as_object()?;
    let needed = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let missing = needed.into_iter().find(|key| !object.contains_key(*key)).map(|key| format!("{at}: no {key}"));
    missing.or_else(|| {
        object.iter().find_map(|(key, value)| match schema["properties"].get(key) {
            Some(property) => refused(root, property, value, &format!("{at}.{key}")),
            None => Some(format!("{at}: {key} is not known")),
        })
    })
}

fn refused_file(text: &str) -> Option<String> {
    let value: toml::Value = toml::from_str(text).expect("TOML");
    let (schema, value) = (Cell::schema(), serde_json::to_value(value).expect("a JSON form"));
    refused(&schema, &schema, &value, "cell")
}

#[test]
fn the_schema_takes_the_files_of_the_house_and_names_what_the_reader_refuses() {
    let shipped = include_str!("../../../config/fr3_cell.toml");
    assert_eq!(refused_file(shipped), None);
    let two = "[[object]]\nname = 'a'\nmesh = 'a.obj'\n[[object]]\nname = 'b'\nmesh = 'b.obj'\n";
    assert!(refused_file(two).is_none() && Cell::parse(two, Path::new("cell.toml")).is_ok());
    assert_eq!(refused_file("[robot]\njoints = ['a']\n[[clip]]\nfile = 'a.mcap'\nkind = 'free_motion'\n"), None);
    for (wrong, named) in [
        ("[table]\nhieght = 0.0\n", "hieght"),
        ("[tabel]\nheight = 0.0\n", "tabel"),
        ("[table]\n", "no height"),
        ("[table]\nheight = 'low'\n", "table.height"),
        ("[controller]\nkind = 'tracking'\n", "controller.kind"),
        ("[object]\nsize = [0.1, 0.1]\n", "2 items"),
        ("[[object]]\nname = 'a'\nmesh = 'a.obj'\n[[object]]\nname = 2\nmesh = 'a.obj'\n", "object.name"),
        ("[[clip]]\nfile = 'a.mcap'\nkind = 'walk'\n", "clip.kind"),
    ] {
        assert!(Cell::parse(wrong, Path::new("cell.toml")).is_err(), "{wrong}");
        let what = refused_file(wrong).unwrap_or_else(|| panic!("the schema takes {wrong}"));
        assert!(what.contains(named), "{what}");
    }
}

#[test]
fn the_schema_names_every_key_of_the_document_with_its_meaning() {
    let schema = Cell::schema();
    let definition = |property: &Value| {
        let text = property.to_string();
        let name =
            text.split("#/$defs/").nth(1).and_then(|rest| rest.split('"').next()).expect("a reference").to_owned();
        schema["$defs"][name].clone()
    };
    let mut keys = 0;
    for (heading, documented) in documented() {
        let mut block = schema.clone();
        for name in heading.trim_matches(['[', ']']).split('.') {
            block = definition(&block["properties"][name]);
        }
        let properties = block["properties"].as_object().expect("keys");
        assert_eq!(properties.keys().cloned().collect::<BTreeSet<_>>(), documented, "{heading}");
        for (key, property) in properties {
            let described = property["description"].as_str().is_some_and(|text| !text.is_empty());
            assert!(described, "{heading} {key} has no description");
            keys += 1;
        }
    }
    assert!(keys > 50, "{keys} keys");
}
