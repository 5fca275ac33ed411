//! How often the interval of a correlation between two worlds holds that of the true shares, over 2,000 simulated studies of twelve
//! policies: `cargo run --release -p evaluation --example correlation_coverage`.

use evaluation::statistics::{Cell, LEVEL, Share, agreement, pearson};
use rand::RngExt as _;
use rand_pcg::Pcg64;
use std::io::{self, Write as _};

const STUDIES: u64 = 2000;

fn trials(generator: &mut Pcg64, p: f64, count: u64) -> Share {
    Share::of((0..count).map(|_| generator.random_bool(p)))
}

fn main() -> io::Result<()> {
    for [low, high] in [[0.1, 0.9], [0.4, 0.8]] {
        for [simulated, real] in [[200, 60], [200, 20], [60, 60]] {
            let mut width = 0.0;
            let holds = |seed: u64| {
                let generator = &mut Pcg64::new(u128::from(seed), 11);
                let mut truth = [Vec::new(), Vec::new()];
                let mut cells = Vec::new();
                for _ in 0..12 {
                    let p: f64 = generator.random_range(low..high);
                    let q = (p + generator.random_range(-0.2..0.2)).clamp(0.02, 0.98);
                    truth[0].push(p);
                    truth[1].push(q);
                    cells.push(Cell { simulated: trials(generator, p, simulated), real: trials(generator, q, real) });
                }
                let found =
                    agreement(&cells, &[0; 12], LEVEL, seed).map_or([f64::NAN; 2], |found| found.pearson_interval);
                width += (found[1] - found[0]) / STUDIES as f64;
                (found[0]..=found[1]).contains(&pearson(&truth[0], &truth[1]))
            };
            let share = Share::of((0..STUDIES).map(holds)).value();
            writeln!(
                io::stdout(),
                "shares {low} to {high}, {simulated} trials each in one world and {real} in the other: {share:.3}, mean width {width:.2}"
            )?;
        }
    }
    Ok(())
}
