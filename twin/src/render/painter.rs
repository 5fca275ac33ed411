//! Who draws: the processor, or with the feature `render` a Vulkan device. The picture is the same.

use super::Mesh;
#[cfg(feature = "render")]
use super::device::{Device, DeviceCanvas};
use nalgebra::Isometry3;
use splat::{Body, Canvas, Lens, Picture, Shape, SplatCloud, Surroundings};

/// What a body looks like, kept by a [`Painter`].
#[derive(Debug, Clone, PartialEq)]
pub enum Model {
    Splats(SplatCloud),
    /// A closed mesh of one colour.
    Mesh(Mesh),
}

impl Model {
    fn shape(&self) -> Shape<'_> {
        match self {
            Self::Splats(cloud) => Shape::Splats(cloud),
            Self::Mesh(mesh) => Shape::Mesh(mesh),
        }
    }
}

/// Who shall draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drawer {
    /// A graphics card where there is one that holds the models, else the processor.
    #[default]
    Auto,
    /// The processor, in double precision.
    Processor,
    /// A Vulkan device, which may be one in software.
    Device,
}

/// The device that was asked for cannot draw.
#[derive(Debug, thiserror::Error)]
pub enum PaintError {
    /// This program was built without.
    #[error("this build draws on the processor only: build it with `--features render`, or let the processor draw")]
    NotBuilt,
    /// What the device says.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Device(#[from] super::device::DeviceError),
}

/// Models that are drawn again and again, through one lens, wherever their poses put them.
#[derive(Debug)]
pub struct Painter {
    backend: Backend,
    /// Who draws, for people.
    name: String,
    /// Why it is not the one that comes first.
    note: Option<String>,
}

#[derive(Debug)]
enum Backend {
    Processor {
        canvas: Canvas,
        models: Vec<(Model, u32)>,
    },
    #[cfg(feature = "render")]
    Device(Box<DeviceCanvas>),
}

impl Painter {
    /// From models with their numbers in the picture (not 0), for pictures of so many columns and rows.
    ///
    /// # Errors
    /// [`PaintError`] when a device was asked for and there is none, or it does not hold the models.
    pub fn new(drawer: Drawer, models: Vec<(Model, u32)>, lens: Lens, size: [usize; 2]) -> Result<Self, PaintError> {
        let mut note = None;
        match (drawer, Self::on_device(drawer, &models, lens, size)) {
            (_, Ok(Some(painter))) => return Ok(painter),
            (Drawer::Device, Err(error)) => return Err(error),
            (Drawer::Auto, Err(error)) => note = Some(error.to_string()),
            _ => {}
        }
        let backend = Backend::Processor { canvas: Canvas::new(lens, size), models };
        Ok(Self { backend, name: "the processor".into(), note })
    }

    #[cfg(feature = "render")]
    fn on_device(
        drawer: Drawer,
        models: &[(Model, u32)],
        lens: Lens,
        size: [usize; 2],
    ) -> Result<Option<Self>, PaintError> {
        if drawer == Drawer::Processor {
            return Ok(None);
        }
        let device = Device::open()?;
        // What the processor would play it draws better itself.
        if drawer == Drawer::Auto && device.is_software() {
            return Ok(None);
        }
        let shapes: Vec<(Shape<'_>, u32)> = models.iter().map(|(model, number)| (model.shape(), *number)).collect();
        let canvas = DeviceCanvas::new(&device, &shapes, lens, size)?;
        Ok(Some(Self { backend: Backend::Device(Box::new(canvas)), name: device.name().to_owned(), note: None }))
    }

    #[cfg(not(feature = "render"))]
    fn on_device(drawer: Drawer, _: &[(Model, u32)], _: Lens, _: [usize; 2]) -> Result<Option<Self>, PaintError> {
        if drawer == Drawer::Device { Err(PaintError::NotBuilt) } else { Ok(None) }
    }

    /// Draws the models, each where its pose says (its frame in the camera's), or not at all.
    ///
    /// # Errors
    /// [`PaintError::Device`] when the device fails.
    pub fn paint(
        &mut self,
        camera_from_body: &[Option<Isometry3<f64>>],
        around: &Surroundings,
    ) -> Result<Picture, PaintError> {
        match &mut self.backend {
            Backend::Processor { canvas, models } => {
                let bodies: Vec<Body<'_>> = (models.iter().zip(camera_from_body))
                    .filter_map(|((model, instance), pose)| {
                        Some(Body { shape: model.shape(), camera_from_body: (*pose)?, instance: *instance })
                    })
                    .collect();
                Ok(canvas.render(&bodies, around))
            }
            #[cfg(feature = "render")]
            Backend::Device(canvas) => Ok(canvas.render(camera_from_body, around)?),
        }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Why the processor draws although a device might have.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }
}
