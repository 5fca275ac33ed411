//! docs/cell.md names every key of cell.toml, block by block, and no other.

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
