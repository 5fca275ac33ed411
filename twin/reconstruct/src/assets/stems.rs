//! Names of files that pictures become: one name for each picture, whatever their paths have in common.

use std::collections::HashMap;

/// What stands behind a picture's name in the names of what is drawn of it.
const SUFFIXES: [&str; 3] = ["", "_splats", "_depth"];

/// For each picture its path as one name, without its ending; with it, where another picture has the same without, and with the
/// picture's number where even that is another's.
pub(super) fn stems<'a>(pictures: impl Iterator<Item = &'a str>) -> Vec<String> {
    let whole: Vec<String> = pictures.map(|name| name.replace(['/', '\\'], "_")).collect();
    let short = |name: &str| name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned();
    let mut taken: HashMap<String, usize> = HashMap::new();
    for name in &whole {
        SUFFIXES.iter().for_each(|suffix| *taken.entry(short(name) + suffix).or_default() += 1);
    }
    let mut twice: HashMap<&str, usize> = HashMap::new();
    whole.iter().for_each(|name| *twice.entry(name.as_str()).or_default() += 1);
    let name = |(number, name): (usize, &String)| {
        let stem = short(name);
        let is_alone = SUFFIXES.iter().all(|suffix| taken[&format!("{stem}{suffix}")] == 1);
        match (is_alone, twice[name.as_str()]) {
            (true, _) => stem,
            (false, 1) => name.clone(),
            (false, _) => format!("{name}.{number}"),
        }
    };
    whole.iter().enumerate().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_one_name_become_files_of_their_own() {
        let named = |pictures: &[&str]| stems(pictures.iter().copied());
        assert_eq!(named(&["images/a.png", "images/b.jpg"]), ["images_a", "images_b"]);
        assert_eq!(named(&["a.png", "a.jpg", "b.jpg"]), ["a.png", "a.jpg", "b"]);
        assert_eq!(named(&["front/1.png", "front_1.png"]), ["front_1.png.0", "front_1.png.1"]);
        // The splats' picture of the first would have the name of the second.
        assert_eq!(named(&["a.png", "a_splats.png"]), ["a.png", "a_splats.png"]);
    }
}
