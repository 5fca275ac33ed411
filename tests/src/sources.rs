//! The sources of the product as text: every file, and of each the lines that are neither tests nor comments.

use crate::texts::PRODUCT;
use std::path::Path;

/// Folders that hold no source of this tree: what is built, and what version control keeps.
const PASSED_OVER: [&str; 2] = ["target", ".git"];

/// A Rust file.
#[derive(Debug, Clone)]
pub struct Source {
    /// Its path from the workspace's root.
    pub file: String,
    pub text: String,
}

impl Source {
    /// Whether it holds nothing but tests, or what tests and measurements alone are built with.
    pub fn is_test(&self) -> bool {
        let (folders, name) = self.file.rsplit_once('/').unwrap_or(("", &self.file));
        name.ends_with("tests.rs")
            || name.starts_with("test_")
            || folders.split('/').any(|folder| ["tests", "benches", "examples"].contains(&folder))
    }

    /// What stands before its tests.
    pub fn product(&self) -> &str {
        self.text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("")
    }

    /// The lines before its tests that are no comments.
    pub fn code(&self) -> impl Iterator<Item = &str> {
        self.product().lines().filter(|line| !line.trim_start().starts_with("//"))
    }

    /// The same as one text.
    pub fn code_text(&self) -> String {
        self.code().collect::<Vec<_>>().join("\n")
    }
}

/// Every Rust file below `folder` of the tree at `root`, in the order of their paths.
///
/// # Panics
/// When one cannot be read.
pub fn below(root: &Path, folder: &str) -> Vec<Source> {
    let (mut found, mut folders) = (Vec::new(), vec![root.join(folder)]);
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        for entry in entries.map(|e| e.expect("an entry").path()) {
            let name = entry.file_name().unwrap_or_default().to_string_lossy();
            if entry.is_dir() && !PASSED_OVER.contains(&&*name) {
                folders.push(entry);
            } else if entry.is_file() && name.ends_with(".rs") {
                let file = entry.strip_prefix(root).expect("below the root").display().to_string();
                found.push(Source { file, text: std::fs::read_to_string(&entry).expect("a readable source") });
            }
        }
    }
    found.sort_by(|a, b| a.file.cmp(&b.file));
    found
}

/// The product's files, tests among them.
pub fn product(root: &Path) -> Vec<Source> {
    PRODUCT.iter().flat_map(|folder| below(root, folder)).collect()
}

/// The product's files that are no tests.
pub fn product_without_tests(root: &Path) -> Vec<Source> {
    product(root).into_iter().filter(|source| !source.is_test()).collect()
}
