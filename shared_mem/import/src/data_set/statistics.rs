//! Least, largest, mean, deviation and quantiles of a feature over all frames, as `meta/stats.json` holds them.

use serde_json::{Map, Value, json};
use shared_mem::msg::image::PixelEncoding;

/// Quantiles by their names.
const QUANTILES: [(&str, f64); 5] = [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)];

/// Of one feature.
#[derive(Debug)]
pub(super) enum Statistics {
    /// All numbers, by their place in the row; whose turn it is.
    Numbers { columns: Vec<Vec<f64>>, next: usize },
    /// How often each value occurs in each channel, and how many pictures there were.
    Pictures { encoding: PixelEncoding, channels: Vec<Vec<u64>>, pictures: u64 },
}

impl Statistics {
    pub(super) fn of_numbers(width: usize) -> Self {
        Self::Numbers { columns: vec![Vec::new(); width], next: 0 }
    }

    pub(super) fn of_pictures(encoding: PixelEncoding) -> Self {
        let channels = match encoding {
            PixelEncoding::Rgb8 => vec![vec![0; 1 << 8]; 3],
            PixelEncoding::Depth16 => vec![vec![0; 1 << 16]],
        };
        Self::Pictures { encoding, channels, pictures: 0 }
    }

    /// Takes the next number of the next row.
    pub(super) fn number(&mut self, value: f64) {
        if let Self::Numbers { columns, next } = self {
            columns[*next].push(value);
            *next = (*next + 1) % columns.len();
        }
    }

    pub(super) fn picture(&mut self, pixels: &[u8]) {
        let Self::Pictures { encoding, channels, pictures } = self else { return };
        *pictures += 1;
        match encoding {
            PixelEncoding::Rgb8 => {
                pixels.iter().enumerate().for_each(|(i, value)| channels[i % 3][usize::from(*value)] += 1);
            }
            PixelEncoding::Depth16 => pixels
                .chunks_exact(2)
                .for_each(|pair| channels[0][usize::from(u16::from_le_bytes([pair[0], pair[1]]))] += 1),
        }
    }

    /// As LeRobot writes it: colour from 0 to 1, depth in millimetres, pictures by channel.
    pub(super) fn json(&mut self) -> Value {
        match self {
            Self::Numbers { columns, .. } => {
                let count = columns.first().map_or(0, Vec::len) as u64;
                let all = columns.iter_mut().map(|values| {
                    values.sort_by(f64::total_cmp);
                    Summary::of(&values.iter().map(|value| (*value, 1)).collect::<Vec<_>>())
                });
                written(&all.collect::<Vec<_>>(), count, |value| json!(value))
            }
            Self::Pictures { encoding, channels, pictures } => {
                let unit = if *encoding == PixelEncoding::Rgb8 { 1.0 / 255.0 } else { 1.0 };
                let all = channels.iter().map(|counts| {
                    let there = counts.iter().enumerate().filter(|(_, count)| **count > 0);
                    Summary::of(&there.map(|(value, count)| (value as f64 * unit, *count)).collect::<Vec<_>>())
                });
                written(&all.collect::<Vec<_>>(), *pictures, |value| json!([[value]]))
            }
        }
    }
}

/// Of one column.
struct Summary {
    min: f64,
    max: f64,
    mean: f64,
    std: f64,
    quantiles: [f64; 5],
}

impl Summary {
    /// Values in rising order, each as often as is said.
    fn of(values: &[(f64, u64)]) -> Self {
        let count: u64 = values.iter().map(|(_, times)| times).sum();
        let mean = values.iter().map(|(value, times)| value * *times as f64).sum::<f64>() / count as f64;
        let square = values.iter().map(|(value, times)| (value - mean).powi(2) * *times as f64).sum::<f64>();
        let nth = |n: u64| {
            let mut before = 0;
            let found = values.iter().find(|(_, times)| {
                before += times;
                before > n
            });
            found.map_or(f64::NAN, |(value, _)| *value)
        };
        let quantiles = QUANTILES.map(|(_, share)| {
            let place = share * count.saturating_sub(1) as f64;
            let (low, high) = (nth(place.floor() as u64), nth(place.ceil() as u64));
            low + (high - low) * place.fract()
        });
        Self {
            min: values.first().map_or(f64::NAN, |(value, _)| *value),
            max: values.last().map_or(f64::NAN, |(value, _)| *value),
            mean,
            std: (square / count as f64).sqrt(),
            quantiles,
        }
    }
}

fn written(columns: &[Summary], count: u64, one: impl Fn(f64) -> Value) -> Value {
    let list = |of: &dyn Fn(&Summary) -> f64| columns.iter().map(|column| one(of(column))).collect::<Value>();
    let mut all = Map::new();
    all.insert("min".into(), list(&|column| column.min));
    all.insert("max".into(), list(&|column| column.max));
    all.insert("mean".into(), list(&|column| column.mean));
    all.insert("std".into(), list(&|column| column.std));
    all.insert("count".into(), json!([count]));
    for (i, (name, _)) in QUANTILES.iter().enumerate() {
        all.insert((*name).into(), list(&|column| column.quantiles[i]));
    }
    Value::Object(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_summed_up_column_by_column() {
        let mut statistics = Statistics::of_numbers(2);
        for row in 0..101 {
            statistics.number(f64::from(row));
            statistics.number(7.0);
        }
        let json = statistics.json();
        assert_eq!(json["min"], json!([0.0, 7.0]));
        assert_eq!(json["mean"], json!([50.0, 7.0]));
        assert_eq!((&json["q01"], &json["q90"]), (&json!([1.0, 7.0]), &json!([90.0, 7.0])));
        assert_eq!((&json["std"][1], &json["count"]), (&json!(0.0), &json!([101])));
        assert!((json["std"][0].as_f64().expect("a number") - 850.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn pictures_are_summed_up_channel_by_channel() {
        let mut colour = Statistics::of_pictures(PixelEncoding::Rgb8);
        colour.picture(&[0, 51, 255, 0, 153, 255]);
        let json = colour.json();
        assert_eq!((&json["max"], &json["count"]), (&json!([[[0.0]], [[0.6]], [[1.0]]]), &json!([1])));
        let mut depth = Statistics::of_pictures(PixelEncoding::Depth16);
        depth.picture(&[0x10, 0x27, 0x10, 0x27]);
        assert_eq!(depth.json()["mean"], json!([[[10_000.0]]]));
    }
}
