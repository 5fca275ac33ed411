//! One picture after the other: poses go to the device, the picture comes back.

use super::passes::{DEPTH, Passes, SURFACE};
use super::upload::Upload;
use super::view::{BODY, Facts, VIEW, body_bytes, view_bytes};
use super::{Device, DeviceError};
use nalgebra::Isometry3;
use splat::{Lens, Picture, Shape, Straight, Surroundings};
use wgpu::BufferUsages as Usages;

/// Edge of a tile [pixel], and threads of a group that goes through splats, as in `splats.wgsl`.
const TILE: u32 = 8;
const GROUP: u32 = 256;
/// Bytes of a projected splat, of an entry of a tile's list, and of a pixel that comes back.
const SPLAT_BYTES: u64 = 48;
const ENTRY: u64 = 8;
const PIXEL: u64 = 24;

/// Models on a device, and the view that they are drawn in.
#[derive(Debug)]
pub struct DeviceCanvas {
    device: Device,
    passes: Passes,
    models: Upload,
    lens: Lens,
    size: [usize; 2],
    straight: Straight,
    buffers: Buffers,
    /// Depth and surface of the meshes.
    solid: [wgpu::TextureView; 2],
    mesh_group: wgpu::BindGroup,
    lists: Lists,
}

#[derive(Debug)]
struct Buffers {
    view: wgpu::Buffer,
    bodies: wgpu::Buffer,
    seen: wgpu::Buffer,
    tiles: wgpu::Buffer,
    lookup: wgpu::Buffer,
    picture: wgpu::Buffer,
    /// Picture and length of all lists, for this side to read.
    back: wgpu::Buffer,
}

/// The tiles' lists: as much room as any picture needed so far.
#[derive(Debug)]
struct Lists {
    room: u64,
    group: wgpu::BindGroup,
}

impl DeviceCanvas {
    /// Uploads models with their numbers in the picture (not 0), for pictures of so many columns and rows.
    ///
    /// # Errors
    /// [`DeviceError::Room`] when the device does not hold them.
    pub fn new(
        device: &Device,
        models: &[(Shape<'_>, u32)],
        lens: Lens,
        size: [usize; 2],
    ) -> Result<Self, DeviceError> {
        let straight = Straight::new(&lens, size);
        device.check_picture(straight.size)?;
        let pixels = (size[0] * size[1]) as u64;
        device.check_room(|| format!("pictures of {} x {} pixels", size[0], size[1]), pixels * PIXEL + 4)?;
        let models = Upload::new(device, models)?;
        let splats = u64::from(models.count);
        let passes = Passes::new(device)?;
        let [columns, rows] = tiles(size).map(u64::from);
        let lookup = straight.lookup.iter().flat_map(|pixel| pixel.to_ne_bytes()).collect();
        let buffers = Buffers {
            view: device.buffer(VIEW, Usages::UNIFORM | Usages::COPY_DST)?,
            bodies: device.buffer(models.bodies.len() as u64 * BODY, Usages::STORAGE | Usages::COPY_DST)?,
            seen: device.buffer(splats * SPLAT_BYTES, Usages::STORAGE)?,
            tiles: device
                .buffer((2 * columns * rows + 1) * 4, Usages::STORAGE | Usages::COPY_DST | Usages::COPY_SRC)?,
            lookup: device.send(lookup, Usages::STORAGE)?,
            picture: device.buffer(pixels * PIXEL, Usages::STORAGE | Usages::COPY_SRC)?,
            back: device.buffer(pixels * PIXEL + 4, Usages::MAP_READ | Usages::COPY_DST)?,
        };
        let solid_size = if models.has_meshes() { straight.size } else { [1, 1] };
        let solid = [device.texture(DEPTH, solid_size)?, device.texture(SURFACE, solid_size)?];
        let mesh_group = device.group(&passes.mesh_layout, &[&buffers.view, &buffers.bodies], &[])?;
        let room = (4 * splats).clamp(1 << 16, device.room() / ENTRY);
        let lists = Lists::new(device, room, &passes, &models, &buffers, &solid)?;
        Ok(Self { device: device.clone(), passes, models, lens, size, straight, buffers, solid, mesh_group, lists })
    }

    /// Draws the models, each where its pose says (its frame in the camera's), or not at all.
    ///
    /// # Errors
    /// [`DeviceError`] when the device fails or the splats lie in more tiles than it holds.
    pub fn render(
        &mut self,
        camera_from_body: &[Option<Isometry3<f64>>],
        around: &Surroundings,
    ) -> Result<Picture, DeviceError> {
        let mut bodies = Vec::with_capacity(self.models.bodies.len() * BODY as usize);
        for (number, part) in self.models.bodies.iter().enumerate() {
            body_bytes(part, camera_from_body.get(number).copied().flatten().as_ref(), &mut bodies);
        }
        self.device.queue.write_buffer(&self.buffers.bodies, 0, &bodies);
        loop {
            let groups = self.groups();
            let view = view_bytes(&Facts {
                lens: &self.lens,
                size: self.size,
                tiles: tiles(self.size),
                straight: &self.straight,
                around,
                splats: self.models.count,
                room: self.lists.room as u32,
                has_meshes: self.models.has_meshes(),
                row_of_groups: groups[0],
            });
            self.device.queue.write_buffer(&self.buffers.view, 0, &view);
            let (picture, needed) = self.device.making(|| self.draw(camera_from_body, groups))??;
            if needed <= self.lists.room {
                return Ok(picture);
            }
            // More than ever before: with a quarter to spare, once more.
            self.device.check_room(|| format!("{needed} entries of splats in tiles"), needed * ENTRY)?;
            let room = (needed + needed / 4).min(self.device.room() / ENTRY);
            self.lists = Lists::new(&self.device, room, &self.passes, &self.models, &self.buffers, &self.solid)?;
        }
    }

    /// Groups that go through all splats: a row is no longer than a device must allow.
    fn groups(&self) -> [u32; 2] {
        let groups = self.models.count.div_ceil(GROUP);
        let row = groups.clamp(1, 65_535);
        [row, groups.div_ceil(row)]
    }

    /// The picture, and how long all lists are together.
    fn draw(
        &self,
        camera_from_body: &[Option<Isometry3<f64>>],
        groups: [u32; 2],
    ) -> Result<(Picture, u64), DeviceError> {
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.buffers.tiles, 0, None);
        if self.models.has_meshes() {
            self.draw_meshes(&mut encoder, camera_from_body);
        }
        let [columns, rows] = tiles(self.size);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_bind_group(0, &self.lists.group, &[]);
            let all = [groups, [1, 1], groups, [columns, rows], [columns, rows]];
            for (pipeline, [x, y]) in self.passes.splats.iter().zip(all) {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(x, y, 1);
            }
        }
        let bytes = (self.size[0] * self.size[1]) as u64 * PIXEL;
        let end = 8 * u64::from(columns) * u64::from(rows);
        encoder.copy_buffer_to_buffer(&self.buffers.picture, 0, &self.buffers.back, 0, bytes);
        encoder.copy_buffer_to_buffer(&self.buffers.tiles, end, &self.buffers.back, bytes, 4);
        self.device.queue.submit([encoder.finish()]);
        self.read(bytes)
    }

    fn draw_meshes(&self, encoder: &mut wgpu::CommandEncoder, camera_from_body: &[Option<Isometry3<f64>>]) {
        let [depth, surface] = &self.solid;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: surface,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.passes.meshes);
        pass.set_bind_group(0, &self.mesh_group, &[]);
        pass.set_vertex_buffer(0, self.models.corners.slice(..));
        for ((part, pose), number) in self.models.bodies.iter().zip(camera_from_body).zip(0..) {
            if pose.is_some() && !part.corners.is_empty() {
                pass.draw(part.corners.clone(), number..number + 1);
            }
        }
    }

    /// Waits for the device and reads what it drew.
    fn read(&self, bytes: u64) -> Result<(Picture, u64), DeviceError> {
        let (done, answer) = std::sync::mpsc::channel();
        let slice = self.buffers.back.slice(..);
        slice.map_async(wgpu::MapMode::Read, move |result| {
            let _ = done.send(result);
        });
        self.device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| self.device.failed(&error))?;
        answer.recv().map_err(|error| self.device.failed(&error))?.map_err(|error| self.device.failed(&error))?;
        let pixels = self.size[0] * self.size[1];
        let mut picture = Picture {
            size: self.size,
            color: Vec::with_capacity(pixels),
            depth: Vec::with_capacity(pixels),
            instance: Vec::with_capacity(pixels),
            cover: Vec::with_capacity(pixels),
        };
        let needed = {
            let view = slice.get_mapped_range().map_err(|error| self.device.failed(&error))?;
            let (drawn, rest) = view.split_at(bytes as usize);
            for pixel in drawn.chunks_exact(PIXEL as usize) {
                let word = |i: usize| u32::from_ne_bytes([0, 1, 2, 3].map(|k| pixel[4 * i + k]));
                let number = |i: usize| f32::from_bits(word(i));
                picture.color.push([number(0), number(1), number(2)]);
                picture.depth.push(number(3));
                picture.instance.push(word(4));
                picture.cover.push(number(5));
            }
            rest.first_chunk().map_or(0, |word| u32::from_ne_bytes(*word))
        };
        self.buffers.back.unmap();
        Ok((picture, u64::from(needed)))
    }
}

impl Lists {
    fn new(
        device: &Device,
        room: u64,
        passes: &Passes,
        models: &Upload,
        buffers: &Buffers,
        solid: &[wgpu::TextureView; 2],
    ) -> Result<Self, DeviceError> {
        let entries = device.buffer(room * ENTRY, Usages::STORAGE)?;
        let Buffers { view, bodies, seen, tiles, lookup, picture, .. } = buffers;
        let all = [view, bodies, &models.splats, &models.harmonics, seen, tiles, &entries, picture, lookup];
        // The textures are bound in the order depth, surface.
        Ok(Self { room, group: device.group(&passes.splat_layout, &all, solid)? })
    }
}

fn tiles(size: [usize; 2]) -> [u32; 2] {
    size.map(|pixels| (pixels as u32).div_ceil(TILE))
}
