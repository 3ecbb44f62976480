//! The same triangles as a file of every mesh format, written from the formats' own descriptions.
//!
//! Coordinates have z up and metres; `f32` must hold them. Triangles of one name stand together.

use std::fmt::Write;

/// Corners [m] and the name of the material.
pub type Triangle = ([[f64; 3]; 3], &'static str);

/// A box of 10 × 7 × 3 m with a `floor` and other `walls`, and a screen of two triangles in it.
pub fn room() -> Vec<Triangle> {
    let corner = |i: usize| [[0.0, 10.0][i & 1], [0.0, 7.0][i >> 1 & 1], [0.0, 3.0][i >> 2]];
    let quads = [[0, 1, 3, 2], [0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [4, 6, 7, 5]];
    let mut triangles = Vec::new();
    for (i, [a, b, c, d]) in quads.into_iter().enumerate() {
        let name = if i == 0 { "floor" } else { "walls" };
        triangles.extend([[a, b, c], [a, c, d]].map(|corners| (corners.map(corner), name)));
    }
    let screen = [[6.0, 2.0, 0.5], [6.0, 5.0, 0.5], [6.0, 5.0, 2.25], [6.0, 2.0, 2.25]];
    triangles.extend([[0, 1, 2], [0, 2, 3]].map(|corners: [usize; 3]| (corners.map(|i| screen[i]), "walls")));
    triangles
}

/// The same triangles without names but `walls`.
pub fn nameless(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|(corners, _)| (*corners, "walls")).collect()
}

/// OBJ with `usemtl`.
pub fn obj(triangles: &[Triangle]) -> Vec<u8> {
    let mut text = String::new();
    for (corners, name) in triangles {
        for [x, y, z] in corners {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        let _ = writeln!(text, "usemtl {name}\nf -3 -2 -1");
    }
    text.into_bytes()
}

/// STL as text, a solid for each name.
pub fn stl_text(triangles: &[Triangle]) -> Vec<u8> {
    let mut text = String::new();
    for part in triangles.chunk_by(|a, b| a.1 == b.1) {
        let _ = writeln!(text, "solid {}", part[0].1);
        for (corners, _) in part {
            text += "  facet normal 0 0 0\n    outer loop\n";
            for [x, y, z] in corners {
                let _ = writeln!(text, "      vertex {x} {y} {z}");
            }
            text += "    endloop\n  endfacet\n";
        }
        let _ = writeln!(text, "endsolid {}", part[0].1);
    }
    text.into_bytes()
}

/// Binary STL; names are lost.
pub fn stl_binary(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for (corners, _) in triangles {
        bytes.extend([0; 12]);
        corners.iter().flatten().for_each(|number| bytes.extend((*number as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// PLY, as text or binary with the low byte first; names are lost.
pub fn ply(triangles: &[Triangle], is_text: bool) -> Vec<u8> {
    let format = if is_text { "ascii" } else { "binary_little_endian" };
    let (vertices, faces) = (3 * triangles.len(), triangles.len());
    let head = format!(
        "ply\nformat {format} 1.0\ncomment a room\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let mut bytes = head.into_bytes();
    for [x, y, z] in triangles.iter().flat_map(|(corners, _)| corners) {
        if is_text {
            bytes.extend(format!("{x} {y} {z}\n").into_bytes());
        } else {
            [x, y, z].into_iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        }
    }
    for face in 0..triangles.len() as i32 {
        let [a, b, c] = [0, 1, 2].map(|corner| 3 * face + corner);
        if is_text {
            bytes.extend(format!("3 {a} {b} {c}\n").into_bytes());
        } else {
            bytes.push(3);
            [a, b, c].into_iter().for_each(|index| bytes.extend(index.to_le_bytes()));
        }
    }
    bytes
}

/// DXF in millimetres, as 3DFACE entities or as a polyface mesh for each layer, all of it in a block.
pub fn dxf(triangles: &[Triangle], is_polyface: bool) -> Vec<u8> {
    let mut entities = String::new();
    let mut pair = |code: i32, value: &str| {
        let _ = write!(entities, "{code:>3}\r\n{value}\r\n");
    };
    let point = |pair: &mut dyn FnMut(i32, &str), code: i32, corner: &[f64; 3]| {
        for (axis, number) in corner.iter().enumerate() {
            pair(code + 10 * axis as i32, &(1000.0 * number).to_string());
        }
    };
    for part in triangles.chunk_by(|a, b| a.1 == b.1) {
        let layer = part[0].1;
        if !is_polyface {
            for ([a, b, c], _) in part {
                pair(0, "3DFACE");
                pair(8, layer);
                for (code, corner) in [(10, a), (11, b), (12, c), (13, c)] {
                    point(&mut pair, code, corner);
                }
            }
            continue;
        }
        for (code, value) in [(0, "POLYLINE"), (8, layer), (66, "1"), (70, "64")] {
            pair(code, value);
        }
        for corner in part.iter().flat_map(|(corners, _)| corners) {
            pair(0, "VERTEX");
            pair(8, layer);
            point(&mut pair, 10, corner);
            pair(70, "192");
        }
        for face in 0..part.len() {
            for (code, value) in [(0, "VERTEX"), (8, layer), (70, "128")] {
                pair(code, value);
            }
            for corner in 0..3 {
                // A negative index hides the edge that begins there.
                let sign = if corner == 1 { "-" } else { "" };
                pair(71 + corner, &format!("{sign}{}", 3 * face as i32 + corner + 1));
            }
        }
        pair(0, "SEQEND");
    }
    let head = "0\r\nSECTION\r\n2\r\nHEADER\r\n9\r\n$INSUNITS\r\n70\r\n4\r\n0\r\nENDSEC\r\n";
    let block = format!(
        "0\r\nSECTION\r\n2\r\nBLOCKS\r\n0\r\nBLOCK\r\n8\r\n0\r\n2\r\nroom\r\n10\r\n0\r\n20\r\n0\r\n30\r\n0\r\n{entities}0\r\nENDBLK\r\n0\r\nENDSEC\r\n"
    );
    let body = "0\r\nSECTION\r\n2\r\nENTITIES\r\n0\r\nLINE\r\n8\r\n0\r\n0\r\nINSERT\r\n8\r\n0\r\n2\r\nroom\r\n10\r\n0\r\n20\r\n0\r\n30\r\n0\r\n0\r\nENDSEC\r\n0\r\nEOF\r\n";
    format!("{head}{block}{body}").into_bytes()
}

/// glTF with y up, a primitive for each name, under a node that scales and moves.
pub fn gltf(triangles: &[Triangle], is_binary: bool) -> Vec<u8> {
    const PLACE: [f64; 3] = [1.0, 0.5, -2.0];
    let (mut data, mut views, mut accessors, mut primitives, mut materials) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (i, part) in triangles.chunk_by(|a, b| a.1 == b.1).enumerate() {
        let start = data.len();
        for [x, y, z] in part.iter().flat_map(|(corners, _)| corners) {
            for (number, place) in [*x, *z, -*y].into_iter().zip(PLACE) {
                data.extend((((number - place) / 2.0) as f32).to_le_bytes());
            }
        }
        let count = 3 * part.len();
        views.push(format!(r#"{{"buffer":0,"byteOffset":{start},"byteLength":{}}}"#, data.len() - start));
        let at = data.len();
        (0..count as u16).for_each(|index| data.extend(index.to_le_bytes()));
        views.push(format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{}}}"#, data.len() - at));
        data.resize(data.len().next_multiple_of(4), 0);
        let (low, high) = ("[-9,-9,-9]", "[9,9,9]");
        accessors.push(format!(r#"{{"bufferView":{},"componentType":5126,"count":{count},"type":"VEC3","min":{low},"max":{high}}}"#, 2 * i));
        accessors.push(format!(
            r#"{{"bufferView":{},"componentType":5123,"count":{count},"type":"SCALAR"}}"#,
            2 * i + 1
        ));
        primitives.push(format!(
            r#"{{"attributes":{{"POSITION":{}}},"indices":{},"material":{i}}}"#,
            2 * i,
            2 * i + 1
        ));
        materials.push(format!(r#"{{"name":"{}"}}"#, part[0].1));
    }
    let uri = if is_binary { "" } else { r#","uri":"room%20data.bin""# };
    let [x, y, z] = PLACE;
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1],"translation":[{x},{y},{z}]}},{{"mesh":0,"scale":[2,2,2]}}],"meshes":[{{"primitives":[{}]}}],"materials":[{}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}{uri}}}]}}"#,
        primitives.join(","),
        materials.join(","),
        accessors.join(","),
        views.join(","),
        data.len()
    );
    if !is_binary {
        return json.into_bytes();
    }
    while json.len() % 4 > 0 {
        json.push(' ');
    }
    let chunk =
        |kind: &[u8], content: &[u8]| [&(content.len() as u32).to_le_bytes()[..], kind, content].concat();
    let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &data)].concat();
    let head = [&b"glTF"[..], &2u32.to_le_bytes(), &(12 + chunks.len() as u32).to_le_bytes()].concat();
    [head, chunks].concat()
}

/// The buffer beside a `.gltf` of [`gltf`]: the binary part of the same file.
pub fn gltf_buffer(triangles: &[Triangle]) -> Vec<u8> {
    let binary = gltf(triangles, true);
    let json = u32::from_le_bytes([binary[12], binary[13], binary[14], binary[15]]) as usize;
    binary[28 + json..].to_vec()
}

/// The room in every format that keeps names: name of the file and its bytes.
pub fn named_files(triangles: &[Triangle]) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("room.obj", obj(triangles)),
        ("text.stl", stl_text(triangles)),
        ("faces.dxf", dxf(triangles, false)),
        ("polyface.DXF", dxf(triangles, true)),
        ("room.glb", gltf(triangles, true)),
        ("room.gltf", gltf(triangles, false)),
    ]
}

/// The room in every format, all named `walls`.
pub fn files(triangles: &[Triangle]) -> Vec<(&'static str, Vec<u8>)> {
    let triangles = nameless(triangles);
    let mut files = named_files(&triangles);
    files.extend([
        ("binary.stl", stl_binary(&triangles)),
        ("text.ply", ply(&triangles, true)),
        ("binary.ply", ply(&triangles, false)),
    ]);
    files
}
