//! Takes one picture with the simulated camera and writes it as two PNG files: colour, and depth with 0.4 m white and
//! 2 m black. `cargo run --release -p twin --example simulated_picture -- config/fr3_cell.toml /tmp`

use shared_mem::cell::Cell;
use shared_mem::output::Output;
use std::path::{Path, PathBuf};
use twin::sensors::camera::SimCamera;
use twin::sim::SimCell;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let cell = arguments.next().unwrap_or_else(|| "config/fr3_cell.toml".into());
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| ".".into()));
    let cell = Cell::read(Path::new(&cell))?;
    let scene = SimCell::new(&cell, None)?.snapshot();
    let mut camera = SimCamera::new(&cell)?;
    let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
    let [header, _] = camera.render(&scene, &mut color, &mut depth);
    let gray: Vec<u8> = depth
        .chunks_exact(2)
        .map(|b| match u16::from_le_bytes([b[0], b[1]]) {
            0 => 0,
            millimetres => (255.0 * (2000.0 - f32::from(millimetres)).max(0.0) / 1600.0) as u8,
        })
        .collect();
    write(&folder.join("color.png"), png::ColorType::Rgb, (header.width, header.height), &color)?;
    write(&folder.join("depth.png"), png::ColorType::Grayscale, (header.width, header.height), &gray)
}

fn write(path: &Path, color: png::ColorType, (width, height): (u32, u32), bytes: &[u8]) -> anyhow::Result<()> {
    let mut output = Output::create(path)?;
    let mut encoder = png::Encoder::new(&mut output, width, height);
    encoder.set_color(color);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(output.finish()?)
}
