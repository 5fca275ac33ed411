//! How the twin looks and who draws it: the arguments that every verb with pictures has.

use crate::render::Drawer;
use crate::render::session::{TwinView, ViewError};
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::quantity::number;
use std::path::PathBuf;

/// The robot's looks, and the device.
#[derive(clap::Args)]
pub(crate) struct Look {
    /// Folder with a splat file for each link (`…link0….ply` to `…link7….ply`, `…hand….ply`), in the links' frames
    #[arg(long, value_name = "FOLDER")]
    splats: Option<PathBuf>,
    /// Joint positions [rad], with commas between them, at which the arm was scanned: then all splats are in its base frame
    #[arg(long, value_name = "Q", requires = "splats", allow_hyphen_values = true, value_delimiter = ',', value_parser = joint)]
    scanned_at: Option<Vec<f64>>,
    /// Who draws the twin
    #[arg(long, value_enum, default_value_t = Device::Auto)]
    device: Device,
}

/// A joint's position [rad]: degrees would lie outside.
pub(super) fn joint(text: &str) -> Result<f64, String> {
    number(text, -7.0..=7.0, "rad, or m where a joint slides")
}

/// Who draws, as it is asked for.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Device {
    /// A graphics card that holds the models, else the processor
    Auto,
    /// The processor, in double precision
    Cpu,
    /// A Vulkan device, even one in software; an error where there is none
    Gpu,
}

impl From<Device> for Drawer {
    fn from(device: Device) -> Self {
        match device {
            Device::Auto => Self::Auto,
            Device::Cpu => Self::Processor,
            Device::Gpu => Self::Device,
        }
    }
}

impl Look {
    /// The twin as the cell's camera sees it; says on stderr why a device does not draw although it might, and which splats lie
    /// beside their link.
    pub(crate) fn view(&self, cell: &Cell) -> Result<TwinView, ViewError> {
        let view = TwinView::new(cell, self.splats.as_deref(), self.scanned_at.as_deref(), self.device.into())?;
        if let Some(note) = view.painter().note() {
            console::line(format_args!("note: the processor draws: {note}"));
        }
        view.remarks().iter().for_each(|remark| console::line(format_args!("note: {remark}")));
        Ok(view)
    }
}
