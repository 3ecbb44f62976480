//! The room in three dimensions: surfaces by material, sources, receivers.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use sonel_analysis::Parameter;
use sonel_analysis::average::single_number;

use super::charts::{color, rounded};
use super::page::{Page, escaped};
use super::{Subject, Traced, reflections};

/// Draws the room of `map`, or sources and receivers alone.
pub fn section(page: &mut Page, subjects: &[Subject], map: Option<&Traced>) {
    page.section("Room");
    let subject = &subjects[0];
    let mut data = map.map(surfaces).unwrap_or_default();
    let up = map.map_or([0.0, 0.0, 1.0], |map| map.walked.map.header().scene.up.to_array());
    data.push(stations(
        "source",
        &subject.response.source_names,
        &subject.response.source_positions,
        json!({
            "size": 7, "symbol": "diamond", "color": "#d62728",
        }),
    ));
    data.push(receivers(subject));
    let [x, y, z] = up;
    let axis = |name: &str| json!({ "title": { "text": format!("{name} [m]") } });
    let chart = json!({ "data": data, "layout": {
        "margin": { "l": 0, "r": 0, "t": 10, "b": 0 },
        "legend": { "x": 0, "y": 1 },
        "scene": {
            "aspectmode": "data", "xaxis": axis("x"), "yaxis": axis("y"), "zaxis": axis("z"),
            "camera": { "up": { "x": x, "y": y, "z": z } }, "uirevision": "turned",
        },
    } });
    match map {
        Some(map) => page.chart_with_choice(&chart, &reflections::sets(subjects, map)),
        None => page.chart("tall", &chart),
    }
    match map {
        Some(_) => page.note("Turn with the mouse; a click in the legend shows or hides a material or a class of reflections. Receivers are coloured by strength G at 500 and 1000 Hz. \
             Lines are the direct sound and early reflections of the chosen pair, by number of reflections or by delay; point at one for both."),
        None => page.note("Surfaces are drawn where the map is given to the report as well."),
    }
}

/// A translucent body for every material.
fn surfaces(map: &Traced) -> Vec<Value> {
    let scene = &map.walked.map.header().scene;
    let of_material = |(material, index): (usize, &str)| {
        let mut places: BTreeMap<u32, usize> = BTreeMap::new();
        let (mut points, mut corners) = ([vec![], vec![], vec![]], [vec![], vec![], vec![]]);
        for triangle in scene.mesh.triangles.iter().filter(|triangle| triangle.material as usize == material)
        {
            for (corner, vertex) in corners.iter_mut().zip(triangle.corners) {
                let next = places.len();
                let place = *places.entry(vertex).or_insert(next);
                if place == next {
                    let position = scene.mesh.vertices[vertex as usize].to_array();
                    points.iter_mut().zip(position).for_each(|(axis, value)| axis.push(rounded(value)));
                }
                corner.push(place);
            }
        }
        let ([x, y, z], [i, j, k]) = (points, corners);
        json!({
            "type": "mesh3d", "name": escaped(index), "showlegend": true, "opacity": 0.3, "flatshading": true,
            "color": color(material), "hoverinfo": "name", "x": x, "y": y, "z": z, "i": i, "j": j, "k": k,
        })
    };
    let names = scene.materials.iter().map(|material| material.name.as_str()).enumerate();
    names.map(of_material).filter(|trace| !trace["i"].as_array().is_none_or(Vec::is_empty)).collect()
}

fn stations(what: &str, names: &[String], positions: &[[f64; 3]], marker: Value) -> Value {
    let axis = |axis: usize| positions.iter().map(|position| rounded(position[axis])).collect::<Vec<_>>();
    let names: Vec<String> = names.iter().map(|name| escaped(name)).collect();
    json!({
        "type": "scatter3d", "mode": "markers", "name": format!("{what}s"), "marker": marker, "text": names,
        "hovertemplate": "%{text}<br>%{x}, %{y}, %{z} m<extra></extra>", "x": axis(0), "y": axis(1), "z": axis(2),
    })
}

/// Receivers, coloured by the strength of the first source where all have one.
fn receivers(subject: &Subject) -> Value {
    let response = &subject.response;
    let first = subject.parameters.iter().take(response.receivers());
    let strengths: Option<Vec<f64>> =
        first.map(|receiver| Some(single_number(receiver, Parameter::Strength).ok()?.value)).collect();
    let marker = match strengths {
        Some(strengths) => json!({
            "size": 5, "color": strengths, "colorscale": "Viridis", "showscale": true,
            "colorbar": { "title": { "text": "G [dB]" }, "len": 0.6 },
        }),
        None => json!({ "size": 5, "color": "#1f77b4" }),
    };
    stations("receiver", &response.receiver_names, &response.receiver_positions, marker)
}
