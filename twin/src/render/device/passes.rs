//! The programs and what they see. One layout for all programs over splats, one for the drawing of meshes.

use super::upload::CORNER;
use super::{Device, DeviceError};
use wgpu::BufferBindingType::{Storage, Uniform};
use wgpu::{BindingType, ShaderStages, TextureFormat};

/// Depth of the meshes as the nearest distance over the distance, and colour with body.
pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
pub(super) const SURFACE: TextureFormat = TextureFormat::Rg32Uint;

#[derive(Debug)]
pub(super) struct Passes {
    pub(super) splat_layout: wgpu::BindGroupLayout,
    pub(super) mesh_layout: wgpu::BindGroupLayout,
    /// Projects, shares out, fills, sorts, blends: in this order.
    pub(super) splats: [wgpu::ComputePipeline; 5],
    pub(super) meshes: wgpu::RenderPipeline,
}

impl Passes {
    pub(super) fn new(device: &Device) -> Result<Self, DeviceError> {
        device.making(|| {
            let splat_layout = layout(device, ShaderStages::COMPUTE, &splat_bindings());
            let mesh_layout = layout(device, ShaderStages::VERTEX, &[buffer(Uniform), buffer(READ)]);
            let program = |own: &str| {
                let source = wgpu::ShaderSource::Wgsl([include_str!("shared.wgsl"), own].concat().into());
                device.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source })
            };
            let splats = program(include_str!("splats.wgsl"));
            let pipelines = pipeline_layout(device, &splat_layout);
            let splats = ["project", "share_out", "fill", "sort", "blend"].map(|entry| {
                device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry),
                    layout: Some(&pipelines),
                    module: &splats,
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    cache: None,
                })
            });
            let meshes = mesh_pipeline(device, &mesh_layout, &program(include_str!("meshes.wgsl")));
            Self { splat_layout, mesh_layout, splats, meshes }
        })
    }
}

const READ: wgpu::BufferBindingType = Storage { read_only: true };
const WRITE: wgpu::BufferBindingType = Storage { read_only: false };

fn buffer(ty: wgpu::BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// In the order of their numbers in `splats.wgsl`.
fn splat_bindings() -> [BindingType; 11] {
    let texture = |sample_type| BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let [view, bodies, splats, harmonics] = [Uniform, READ, READ, READ].map(buffer);
    let [seen, tiles, lists, picture, lookup] = [WRITE, WRITE, WRITE, WRITE, READ].map(buffer);
    let [depth, surface] = [wgpu::TextureSampleType::Depth, wgpu::TextureSampleType::Uint].map(texture);
    [view, bodies, splats, harmonics, seen, tiles, lists, picture, lookup, depth, surface]
}

fn layout(device: &Device, visibility: ShaderStages, bindings: &[BindingType]) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (bindings.iter().zip(0..))
        .map(|(ty, binding)| wgpu::BindGroupLayoutEntry { binding, visibility, ty: *ty, count: None })
        .collect();
    device.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

fn pipeline_layout(device: &Device, group: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
    device.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(group)],
        immediate_size: 0,
    })
}

fn mesh_pipeline(device: &Device, group: &wgpu::BindGroupLayout, module: &wgpu::ShaderModule) -> wgpu::RenderPipeline {
    let corner = wgpu::VertexBufferLayout {
        array_stride: CORNER,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Uint32],
    };
    let target = wgpu::ColorTargetState { format: SURFACE, blend: None, write_mask: wgpu::ColorWrites::ALL };
    device.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout(device, group)),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[Some(corner)],
        },
        primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("surface"),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
