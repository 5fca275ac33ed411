//! Dictionaries of square markers: which fields inside a marker's black border are light. The codes of ArUco
//! (Garrido-Jurado et al. 2014) and AprilTag (Olson 2011; Wang & Olson 2016) in the order of OpenCV 5.0's `objdetect`
//! module, Apache-2.0, read from the markers that it draws.

/// The markers of a board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dictionary {
    /// Fields along an edge, the border left out.
    pub side: u32,
    /// A marker's fields row by row, the last one in the lowest bit, 1 for light; the marker's number is the place here.
    codes: Vec<u64>,
}

/// Name without `DICT_`, fields along an edge, markers, and the codes: OpenCV's smaller dictionaries begin a larger one.
type Known = (&'static str, u32, usize, &'static str);

const SQUARE_4: &str = include_str!("dictionaries/4x4_1000.txt");
const SQUARE_5: &str = include_str!("dictionaries/5x5_1000.txt");
const SQUARE_6: &str = include_str!("dictionaries/6x6_1000.txt");
const SQUARE_7: &str = include_str!("dictionaries/7x7_1000.txt");

#[rustfmt::skip]
const KNOWN: [Known; 22] = [
    ("4X4_50", 4, 50, SQUARE_4), ("4X4_100", 4, 100, SQUARE_4), ("4X4_250", 4, 250, SQUARE_4), ("4X4_1000", 4, 1000, SQUARE_4),
    ("5X5_50", 5, 50, SQUARE_5), ("5X5_100", 5, 100, SQUARE_5), ("5X5_250", 5, 250, SQUARE_5), ("5X5_1000", 5, 1000, SQUARE_5),
    ("6X6_50", 6, 50, SQUARE_6), ("6X6_100", 6, 100, SQUARE_6), ("6X6_250", 6, 250, SQUARE_6), ("6X6_1000", 6, 1000, SQUARE_6),
    ("7X7_50", 7, 50, SQUARE_7), ("7X7_100", 7, 100, SQUARE_7), ("7X7_250", 7, 250, SQUARE_7), ("7X7_1000", 7, 1000, SQUARE_7),
    ("APRILTAG_16h5", 4, 30, include_str!("dictionaries/apriltag_16h5.txt")),
    ("APRILTAG_25h9", 5, 35, include_str!("dictionaries/apriltag_25h9.txt")),
    ("APRILTAG_36h10", 6, 2320, include_str!("dictionaries/apriltag_36h10.txt")),
    ("APRILTAG_36h11", 6, 587, include_str!("dictionaries/apriltag_36h11.txt")),
    ("ARUCO_MIP_36h12", 6, 250, include_str!("dictionaries/aruco_mip_36h12.txt")),
    ("ARUCO_ORIGINAL", 5, 1024, include_str!("dictionaries/aruco_original.txt")),
];

impl Dictionary {
    /// The dictionary that OpenCV calls so, with `DICT_` before it or without: `DICT_5X5_100`, `DICT_APRILTAG_36h11`.
    pub fn named(name: &str) -> Option<Self> {
        let name = name.strip_prefix("DICT_").unwrap_or(name);
        let (_, side, markers, codes) = KNOWN.iter().find(|(known, ..)| known.eq_ignore_ascii_case(name))?;
        let codes = codes.lines().take(*markers).filter_map(|code| u64::from_str_radix(code, 16).ok()).collect();
        Some(Self { side: *side, codes })
    }

    /// How many markers there are.
    pub fn markers(&self) -> usize {
        self.codes.len()
    }

    /// Whether the field in a column and a row of a marker is light; `None` beyond the dictionary or the marker.
    pub fn is_light(&self, marker: usize, column: u32, row: u32) -> Option<bool> {
        let code = self.codes.get(marker).filter(|_| column < self.side && row < self.side)?;
        let after = self.side * self.side - 1 - (row * self.side + column);
        Some(code >> after & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(name: &str, marker: usize) -> Vec<String> {
        let dictionary = Dictionary::named(name).expect("a dictionary");
        let field = |row, column| if dictionary.is_light(marker, column, row).expect("a field") { '.' } else { '#' };
        (0..dictionary.side).map(|row| (0..dictionary.side).map(|column| field(row, column)).collect()).collect()
    }

    #[test]
    fn markers_are_as_opencv_draws_them() {
        assert_eq!(drawn("DICT_4X4_50", 0), [".#..", "#.#.", "##..", "##.#"]);
        assert_eq!(drawn("DICT_4X4_250", 7), ["..##", "#.##", "....", "##.#"]);
        assert_eq!(drawn("DICT_5X5_100", 7), ["#...#", "##.##", "##.#.", "###..", "#.#.."]);
        let tag = ["##.###", "#..#.#", "###.#.", "###..#", ".#...#", ".#.#.."];
        assert_eq!(drawn("DICT_APRILTAG_36h11", 0), tag);
        assert_eq!(drawn("APRILTAG_36H11", 0), tag);
    }

    #[test]
    fn every_dictionary_has_its_markers_once() {
        for (name, side, markers, _) in KNOWN {
            let mut codes = Dictionary::named(name).expect("a dictionary").codes;
            codes.sort_unstable();
            codes.dedup();
            assert_eq!(codes.len(), markers, "{name}");
            assert!(codes.iter().all(|code| code >> (side * side) == 0), "{name}");
        }
        assert!(Dictionary::named("DICT_9").is_none());
    }
}
