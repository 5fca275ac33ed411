//! What a device holds: buffers, textures, and whether there is room for them.

use super::{Device, DeviceError, one_line, wait};
use wgpu::util::{BufferInitDescriptor, DeviceExt as _};
use wgpu::{BufferUsages, TextureUsages};

/// No buffer is smaller [byte].
const SMALLEST: usize = 128;

impl Device {
    /// Runs what makes things on the device; a refusal becomes an error.
    pub(super) fn making<T>(&self, make: impl FnOnce() -> T) -> Result<T, DeviceError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let invalid = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        let errors = [wait(invalid.pop()), wait(memory.pop())];
        match errors.into_iter().flatten().next() {
            None => Ok(made),
            Some(error) => Err(self.failed(&error)),
        }
    }

    pub(super) fn failed(&self, error: &dyn std::error::Error) -> DeviceError {
        DeviceError::Failed { name: self.name.clone(), what: one_line(error) }
    }

    /// The largest buffer [byte].
    pub(super) fn room(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_buffer_size.min(limits.max_storage_buffer_binding_size)
    }

    /// Refuses what is larger than the largest buffer.
    pub(super) fn check_room(&self, what: impl FnOnce() -> String, needed: u64) -> Result<(), DeviceError> {
        let room = self.room();
        if needed <= room {
            return Ok(());
        }
        Err(DeviceError::Room { name: self.name.clone(), what: what(), needed, room })
    }

    /// Refuses pictures that are larger than textures can be.
    pub(super) fn check_picture(&self, size: [usize; 2]) -> Result<(), DeviceError> {
        let most = self.device.limits().max_texture_dimension_2d;
        if size.iter().all(|pixels| (1..=most as usize).contains(pixels)) {
            return Ok(());
        }
        Err(DeviceError::Picture { name: self.name.clone(), size, most })
    }

    /// An empty buffer; never smaller than one entry of whatever it may hold, as programs want.
    pub(super) fn buffer(&self, size: u64, usage: BufferUsages) -> Result<wgpu::Buffer, DeviceError> {
        let size = size.max(SMALLEST as u64);
        let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        self.making(|| self.device.create_buffer(&descriptor))
    }

    /// A buffer that holds these bytes; zeros where there are none, because a buffer has to hold something.
    pub(super) fn send(&self, mut bytes: Vec<u8>, usage: BufferUsages) -> Result<wgpu::Buffer, DeviceError> {
        if bytes.is_empty() {
            bytes = vec![0; SMALLEST];
        }
        self.making(|| self.device.create_buffer_init(&BufferInitDescriptor { label: None, contents: &bytes, usage }))
    }

    /// A texture that is drawn to and then read.
    pub(super) fn texture(
        &self,
        format: wgpu::TextureFormat,
        size: [usize; 2],
    ) -> Result<wgpu::TextureView, DeviceError> {
        let descriptor = wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: size[0] as u32, height: size[1] as u32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        self.making(|| self.device.create_texture(&descriptor).create_view(&Default::default()))
    }

    /// What a program sees: buffers, and after them textures, numbered as they come.
    pub(super) fn group(
        &self,
        layout: &wgpu::BindGroupLayout,
        buffers: &[&wgpu::Buffer],
        textures: &[wgpu::TextureView],
    ) -> Result<wgpu::BindGroup, DeviceError> {
        let resources = (buffers.iter().map(|buffer| buffer.as_entire_binding()))
            .chain(textures.iter().map(wgpu::BindingResource::TextureView));
        let entries: Vec<wgpu::BindGroupEntry<'_>> =
            resources.zip(0..).map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource }).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        self.making(|| self.device.create_bind_group(&descriptor))
    }
}
