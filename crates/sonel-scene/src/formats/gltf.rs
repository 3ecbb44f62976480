//! glTF 2.0 files, `.glb` and `.gltf`: the triangles of the default scene with the transforms of their nodes.
//!
//! The `gltf` crate reads and checks the JSON; accessors are read here with every bound checked, because
//! its `utils` panic on wrong counts or strides. Lengths are metres and y is up,
//! as the format demands. The material names the surface, else its node, else its mesh.
//! Named nodes without a mesh are points: a first scene file has sources and receivers there.
//!
//! Reference: [Khronos2021] (docs/references.md).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat3, DMat4, DQuat, DVec3, dvec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Node, Primitive};

use super::collector::Collector;
use super::{Open, ROTATION_ROUNDING, float, right_angled};
use crate::obj::{FileTerms, NAMELESS, Polygons, and_more};
use crate::problem::LineProblem;

/// Deepest nesting of nodes. Chosen: it bounds the recursion's stack; exporters nest some tens deep.
const DEEPEST: usize = 200;
/// A header of a binary file.
const HEADER: u32 = 12;

pub(super) fn read(path: &str, bytes: &[u8], open: Open<'_>) -> Result<Polygons, Vec<LineProblem>> {
    let refused = |message: String| vec![LineProblem::new(0, message)];
    let stated =
        bytes.get(8..12).map(|length| u32::from_le_bytes([length[0], length[1], length[2], length[3]]));
    if bytes.starts_with(b"glTF") && stated.is_none_or(|length| length < HEADER) {
        return Err(refused("the file is cut off in its header".to_owned()));
    }
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(bytes)
        .map_err(|error| refused(format!("the glTF reader refuses the file: {error}")))?;
    let json = document.into_json();
    // The check of the crate takes these indices for granted.
    let attributes =
        json.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|part| part.attributes.values());
    if attributes.into_iter().any(|accessor| accessor.value() >= json.accessors.len()) {
        return Err(refused("a mesh has an accessor that is not there".to_owned()));
    }
    let document = Document::from_json(json)
        .map_err(|error| refused(format!("the glTF reader refuses the file: {error}")))?;
    let buffers = buffers(path, &document, blob, open).map_err(refused)?;
    let terms = FileTerms { counts_lines: false, word: "material", unit: Some((1.0, "m")), is_y_up: true };
    let mut reader = Reader {
        buffers: &buffers,
        collector: Collector::new(terms),
        seen: vec![false; document.nodes().count()],
        count: 0,
        ignored: 0,
        deformed: 0,
    };
    for root in roots(&document) {
        reader.node(&root, DMat4::IDENTITY, 0);
    }
    reader.finish(&document)
}

/// The roots of the default scene, of the first one, or of all nodes where there is no scene.
fn roots(document: &Document) -> Vec<Node<'_>> {
    if let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) {
        return scene.nodes().collect();
    }
    let mut is_child = vec![false; document.nodes().count()];
    document.nodes().flat_map(|node| node.children()).for_each(|child| is_child[child.index()] = true);
    document.nodes().filter(|node| !is_child[node.index()]).collect()
}

/// The bytes of every buffer.
fn buffers(
    path: &str,
    document: &Document,
    blob: Option<Vec<u8>>,
    open: Open<'_>,
) -> Result<Vec<Vec<u8>>, String> {
    let mut blob = blob;
    let folder = path.rfind(['/', '\\']).map_or("./", |at| &path[..=at]);
    let read = |buffer: gltf::Buffer<'_>| match buffer.source() {
        gltf::buffer::Source::Bin => blob.take().ok_or_else(|| "the binary part is missing".to_owned()),
        gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
            let data = uri.split_once(";base64,").ok_or("a buffer is not base64 data")?.1;
            STANDARD.decode(data).map_err(|error| format!("a buffer is not base64 data: {error}"))
        }
        gltf::buffer::Source::Uri(uri) => {
            let name = decoded(uri);
            if !is_beside(&name) {
                return Err(format!("its buffer `{name}` is not beside or below the file: keep it there"));
            }
            open(&format!("{folder}./{name}")).map_err(|error| {
                format!("cannot read its buffer `{folder}{name}`: {error}; keep it beside the file")
            })
        }
    };
    document.buffers().map(read).collect()
}

/// A name of a URI with the bytes of its escapes, such as `%C3%A4`; as it is if they are no UTF-8.
fn decoded(uri: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), uri.as_bytes());
    while let [first, tail @ ..] = rest {
        let digit = |at: usize| char::from(*tail.get(at)?).to_digit(16).filter(|_| *first == b'%');
        let escaped = digit(0).zip(digit(1)).map(|(high, low)| (16 * high + low) as u8);
        bytes.push(escaped.unwrap_or(*first));
        rest = if escaped.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| uri.to_owned())
}

/// Whether a path stays in the folder that it begins in, on every platform.
fn is_beside(path: &str) -> bool {
    let is_absolute = path.starts_with(['/', '\\']) || path.contains(':');
    !is_absolute && path.split(['/', '\\']).all(|part| part != "..")
}

struct Reader<'b> {
    buffers: &'b [Vec<u8>],
    collector: Collector,
    /// Nodes visited.
    seen: Vec<bool>,
    /// Triangles so far.
    count: usize,
    /// Primitives of points and lines.
    ignored: usize,
    /// Meshes with skins or morph targets.
    deformed: usize,
}

impl Reader<'_> {
    fn node(&mut self, node: &Node<'_>, parent: DMat4, depth: usize) {
        if depth > DEEPEST || std::mem::replace(&mut self.seen[node.index()], true) {
            self.collector.problem(0, format!("node {}: the nodes are not a tree", node.index()));
            return;
        }
        let transform = parent * local(node);
        if let Some(mesh) = node.mesh() {
            self.deformed += usize::from(node.skin().is_some() || mesh.weights().is_some());
            for primitive in mesh.primitives() {
                let index = primitive.material().index();
                let name = match (primitive.material().name(), index) {
                    (Some(name), _) => name.to_owned(),
                    (None, Some(index)) => format!("material {index}"),
                    (None, None) => node.name().or(mesh.name()).unwrap_or(NAMELESS).to_owned(),
                };
                if let Err(message) = self.primitive(&primitive, transform, &name) {
                    self.collector.problem(0, format!("mesh {}: {message}", mesh.index()));
                }
            }
        }
        if let (None, Some(name)) = (node.mesh(), node.name()) {
            self.collector.points.push((name.to_owned(), transform.transform_point3(DVec3::ZERO)));
        }
        for child in node.children() {
            self.node(&child, transform, depth + 1);
        }
    }

    fn primitive(&mut self, primitive: &Primitive<'_>, transform: DMat4, name: &str) -> Result<(), String> {
        if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.ignored += 1;
            return Ok(());
        }
        let positions = primitive.get(&gltf::Semantic::Positions).ok_or("it has no POSITION")?;
        let positions = self.positions(&positions)?;
        let corners = match primitive.indices() {
            Some(indices) => self.indices(&indices)?,
            None => (0..positions.len()).collect(),
        };
        if let Some(wrong) = corners.iter().find(|corner| **corner >= positions.len()) {
            return Err(format!("no vertex {wrong}: it has {}, counted from 0", positions.len()));
        }
        let triangles: Vec<[usize; 3]> = match primitive.mode() {
            Mode::TriangleStrip => corners.windows(3).map(|c| [c[0], c[1], c[2]]).collect(),
            Mode::TriangleFan => corners.windows(2).skip(1).map(|c| [corners[0], c[0], c[1]]).collect(),
            _ if corners.len() % 3 != 0 => {
                return Err(format!("{} corners make no triangles", corners.len()));
            }
            _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        };
        for triangle in triangles {
            self.count += 1;
            let corners = triangle.map(|corner| transform.transform_point3(positions[corner]));
            self.collector.face(&corners, name, self.count);
        }
        Ok(())
    }

    fn positions(&self, accessor: &Accessor<'_>) -> Result<Vec<DVec3>, String> {
        if (accessor.dimensions(), accessor.data_type()) != (Dimensions::Vec3, DataType::F32) {
            return Err("positions are not vectors of 32-bit floats: export without quantisation".to_owned());
        }
        let vector = |item: &[u8]| dvec3(float(item, 0), float(item, 4), float(item, 8));
        self.items(accessor, 12)?.map(|item| item.map(vector)).collect()
    }

    fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<usize>, String> {
        let size = match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Scalar, DataType::U8) => 1,
            (Dimensions::Scalar, DataType::U16) => 2,
            (Dimensions::Scalar, DataType::U32) => 4,
            _ => return Err("indices are not unsigned integers".to_owned()),
        };
        let index = |item: &[u8]| item.iter().rev().fold(0, |index, byte| index << 8 | usize::from(*byte));
        self.items(accessor, size)?.map(|item| item.map(index)).collect()
    }

    /// The items of an accessor, each as its bytes; the first one beyond the data is an error.
    fn items<'a>(
        &'a self,
        accessor: &Accessor<'_>,
        size: usize,
    ) -> Result<impl Iterator<Item = Result<&'a [u8], String>>, String> {
        let view = accessor.view().filter(|_| accessor.sparse().is_none());
        let view = view.ok_or("sparse accessors are not read: export without them")?;
        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
        let data = view.offset().checked_add(view.length()).and_then(|end| buffer.get(view.offset()..end));
        let data = data.ok_or("its data lie beyond the buffer: the file is cut off")?;
        let (start, stride) = (accessor.offset(), view.stride().unwrap_or(size));
        let item = move |i: usize| {
            let from = i.checked_mul(stride).and_then(|at| at.checked_add(start));
            let item = from.and_then(|from| data.get(from..from.checked_add(size)?));
            item.ok_or_else(|| "its data lie beyond the buffer: the file is cut off".to_owned())
        };
        Ok((0..accessor.count()).map(item))
    }

    fn finish(mut self, document: &Document) -> Result<Polygons, Vec<LineProblem>> {
        if document.extensions_used().any(|name| name == "EXT_mesh_gpu_instancing") {
            self.collector
                .problem(0, "EXT_mesh_gpu_instancing is not read: export copies instead of instances");
        }
        let remarks = [
            (self.ignored, "points and lines were ignored"),
            (self.deformed, "skins and morph targets are not applied"),
        ];
        for (count, remark) in remarks.into_iter().filter(|(count, _)| *count > 0) {
            self.collector.notes.push((0, format!("{remark}{}", and_more(count))));
        }
        self.collector.finish()
    }
}

/// The transform of a node within its parent.
fn local(node: &Node<'_>) -> DMat4 {
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    match node.transform() {
        gltf::scene::Transform::Matrix { matrix } => {
            let exact = |column: [f32; 4]| {
                let largest = column[..3].iter().fold(0.0, |largest, x| f32::max(largest, x.abs()));
                let least = ROTATION_ROUNDING * f64::from(largest);
                column.map(f64::from).map(|x| if x.abs() < least { 0.0 } else { x })
            };
            let [x, y, z, place] = matrix;
            DMat4::from_cols_array_2d(&[exact(x), exact(y), exact(z), place.map(f64::from)])
        }
        gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
            let rotation = DMat3::from_quat(DQuat::from_array(rotation.map(f64::from)).normalize());
            let turn = DMat4::from_mat3(right_angled(rotation));
            DMat4::from_translation(wide(translation)) * turn * DMat4::from_scale(wide(scale))
        }
    }
}
