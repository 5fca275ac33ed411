//! Pictures on a Vulkan device, a graphics card or Mesa's software one: the only code that knows wgpu. The same maths as
//! the reference in [`splat`], in single precision; splats and meshes are uploaded once and moved by poses.
//!
//! | file | owns |
//! |---|---|
//! | `mod` | finding a device, and what it has no room for |
//! | `memory` | buffers, textures, and room for them |
//! | `upload` | models as the device keeps them |
//! | `view` | what changes with every picture |
//! | `passes` | the programs and what they see |
//! | `canvas` | one picture after the other |
//! | `shared.wgsl`, `meshes.wgsl`, `splats.wgsl` | the programs |

mod canvas;
mod memory;
mod passes;
mod upload;
mod view;

pub use canvas::DeviceCanvas;

use std::task::{Context, Poll, Waker};

/// No picture from a device.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// There is none.
    #[error(
        "no Vulkan device is here: install a driver (mesa-vulkan-drivers holds one in software), or draw on the processor"
    )]
    Missing,
    /// It cannot be opened.
    #[error("{name} cannot be opened: {what}; draw on the processor")]
    Closed {
        name: String,
        /// What it said.
        what: String,
    },
    /// Something is larger than what it holds in one piece.
    #[error(
        "{what} take {} MB, and {name} holds {} MB in one piece: draw less, or on the processor",
        megabytes(*needed), megabytes(*room)
    )]
    Room {
        name: String,
        /// What is too large.
        what: String,
        /// Its size [byte].
        needed: u64,
        /// What the device holds [byte].
        room: u64,
    },
    /// The picture is larger than any that it draws.
    #[error("{name} draws pictures of up to {most} pixels along an edge, not {} x {}: draw smaller ones, or on the processor", size[0], size[1])]
    Picture {
        name: String,
        /// Columns and rows, with what a bent lens needs at the borders.
        size: [usize; 2],
        /// The longest edge [pixel].
        most: u32,
    },
    /// It failed while it drew.
    #[error("{name} failed to draw: {what}; draw on the processor")]
    Failed {
        name: String,
        /// What it said.
        what: String,
    },
}

fn megabytes(bytes: u64) -> u64 {
    bytes.div_ceil(1_000_000)
}

/// A device that is open.
#[derive(Debug, Clone)]
pub struct Device {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
    is_software: bool,
}

impl Device {
    /// The best there is: a card before the processor's graphics, and those before software.
    ///
    /// # Errors
    /// [`DeviceError::Missing`] or [`DeviceError::Closed`].
    pub fn open() -> Result<Self, DeviceError> {
        Self::open_with(|adapter| adapter.limits())
    }

    fn open_with(limits: impl FnOnce(&wgpu::Adapter) -> wgpu::Limits) -> Result<Self, DeviceError> {
        let backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let rank = |adapter: &wgpu::Adapter| match adapter.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        };
        let adapters = wait(instance.enumerate_adapters(backends));
        let adapter = adapters.into_iter().min_by_key(rank).ok_or(DeviceError::Missing)?;
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor { required_limits: limits(&adapter), ..Default::default() };
        let (device, queue) = wait(adapter.request_device(&descriptor))
            .map_err(|error| DeviceError::Closed { name: info.name.clone(), what: one_line(&error) })?;
        Ok(Self { device, queue, name: info.name, is_software: info.device_type == wgpu::DeviceType::Cpu })
    }

    /// What it calls itself.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether the processor plays the device.
    pub fn is_software(&self) -> bool {
        self.is_software
    }
}

/// An error's innermost cause, its first line.
fn one_line(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(deeper) = cause.source() {
        cause = deeper;
    }
    cause.to_string().lines().next().unwrap_or_default().trim_end_matches('.').to_owned()
}

/// What a future answers. Those of native devices are ready when asked.
fn wait<T>(future: impl Future<Output = T>) -> T {
    let mut future = std::pin::pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        match future.as_mut().poll(&mut context) {
            Poll::Ready(value) => return value,
            Poll::Pending => std::thread::yield_now(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, UnitQuaternion, Vector3};
    use shared_mem::lens::Distortion;
    use splat::{Lens, Shape, Splat, SplatCloud};

    #[test]
    fn more_splats_than_a_small_device_holds_are_refused_in_one_line() {
        let small = |adapter: &wgpu::Adapter| wgpu::Limits {
            max_buffer_size: 1 << 22,
            max_storage_buffer_binding_size: 1 << 22,
            ..adapter.limits()
        };
        let device = match Device::open_with(small) {
            Ok(device) => device,
            Err(DeviceError::Missing) => return eprintln!("skipped: no Vulkan device is here"),
            Err(error) => panic!("{error}"),
        };
        let splat = Splat {
            centre: Point3::origin(),
            rotation: UnitQuaternion::identity(),
            sigma: Vector3::repeat(0.01),
            opacity: 0.5,
        };
        let cloud = |count| SplatCloud { splats: vec![splat; count], degree: 0, harmonics: vec![[0.0; 3]; count] };
        let lens = Lens { focal: [100.0; 2], centre: [50.0; 2], distortion: Distortion::NONE };
        let make = |cloud: &SplatCloud| DeviceCanvas::new(&device, &[(Shape::Splats(cloud), 1)], lens, [100, 100]);
        assert!(make(&cloud(60_000)).is_ok());
        let error = make(&cloud(70_000)).expect_err("too many").to_string();
        assert!(
            error.starts_with("70000 splats take 5 MB, and ") && error.contains(" holds 5 MB in one piece"),
            "{error}"
        );
    }
}
