//! Uncertainty of materials: what is predicted from derivatives against renderings with other materials, and what is refused.

use clap::Parser;
use sonel_tests::material_uncertainty::{Uncertain, half_width, values};

use crate::{render, test_folder, trace};

/// Differences over two standard uncertainties have curvature and, as renderings with other materials choose other rays, noise: with five times the
/// packets they are within 0.02.
const TOLERANCE: f64 = 0.1;

#[test]
fn the_interval_of_materials_is_that_of_renderings_with_other_materials() {
    let room = Uncertain::traced(6000);
    let predicted = values(&room.predicted());
    let mut variance = vec![0.0; predicted.len()];
    for material in 0..3 {
        let [less, more] = [-1.0, 1.0].map(|off| {
            let mut offs = [0.0; 3];
            offs[material] = off;
            values(&room.with(offs))
        });
        for (index, (less, more)) in less.iter().zip(&more).enumerate() {
            let change = 0.5 * (more.value - less.value);
            assert!(
                change * predicted[index].materials[material].by_one > 0.0,
                "material {material}, value {index}"
            );
            variance[index] += change * change;
        }
    }
    for (index, (estimate, variance)) in predicted.iter().zip(variance).enumerate() {
        let (found, expected) = (half_width(estimate), 1.96 * variance.sqrt());
        assert!((found / expected - 1.0).abs() < TOLERANCE, "value {index}: {found} instead of {expected}");
    }
    // The bands of a material deviate together: their mean is not less uncertain than they are.
    let half = |index: usize| half_width(&predicted[index]);
    for first in [0, 3, 6] {
        let [low, high, single] = [0, 1, 2].map(|more| half(first + more));
        let independent = 0.5 * low.hypot(high);
        assert!(single > 0.9 * 0.5 * (low + high) && single > 1.2 * independent, "{low} {high} {single}");
    }
    let whole = predicted[0].whole_interval().expect("an interval");
    assert!(whole[1] - whole[0] > 2.0 * half(0));
}

fn analyze(line: &[&str]) -> Result<(String, String), String> {
    let arguments = sonel_analyze::Arguments::try_parse_from([&["sonel-analyze"], line].concat());
    let (mut out, mut log) = (Vec::new(), Vec::new());
    let arguments = arguments.map_err(|error| error.to_string())?;
    sonel_analyze::run(&arguments, &mut out, &mut log).map_err(|error| format!("{error:#}"))?;
    Ok((String::from_utf8(out).expect("text"), String::from_utf8(log).expect("text")))
}

#[test]
fn parameters_print_the_interval_of_the_materials_beside_that_of_the_simulation() {
    let folder = test_folder();
    trace(&folder, "room.sonelmap", &["--packets", "4k"]).unwrap();
    trace(&folder, "other.sonelmap", &["--packets", "500", "--seed", "2"]).unwrap();
    let rays = ["--rays", "64"];
    render(&folder, "room.sonelmap", "a.npz", &rays).unwrap();
    render(
        &folder,
        "room.sonelmap",
        "b.npz",
        &[&rays[..], &["--set", "materials.walls.absorption=0.1"]].concat(),
    )
    .unwrap();
    let [map, other, a, b] = ["room.sonelmap", "other.sonelmap", "a.npz", "b.npz"]
        .map(|name| folder.path(name).display().to_string());
    let ask = |response: &str, map: &str, more: &[&str]| {
        analyze(&[&["parameters", response, "--map", map, "--material-uncertainty"], more].concat())
    };
    let (table, _) = ask(&a, &map, &["0.05"]).unwrap();
    assert!(table.contains("of the simulation, then that of the materials"), "{table}");
    let json = |response: &str, more: &[&str]| -> serde_json::Value {
        let (text, _) = ask(response, &map, &[more, &["--format", "json"]].concat()).unwrap();
        serde_json::from_str(&text).expect("JSON")
    };
    let half = |json: &serde_json::Value| -> f64 {
        let ends = &json["receivers"][0]["bands"][0]["t20_s"]["ci95_materials"];
        0.5 * (ends[1].as_f64().expect("an end") - ends[0].as_f64().expect("an end"))
    };
    let all = json(&a, &["0.05"]);
    assert_eq!(all["material_uncertainty"][0]["material"], "walls");
    assert_eq!(all["receivers"][0]["bands"][0]["t20_s"]["by_material"].as_array().map(Vec::len), Some(2));
    // Twice the uncertainty, twice the change, more than twice the interval of a time; one material is less than both; a live room is more uncertain.
    let twice = json(&a, &["0.1"]);
    let by_walls = |json: &serde_json::Value| {
        json["receivers"][0]["bands"][0]["t20_s"]["by_material"][0].as_f64().expect("a change")
    };
    assert!((by_walls(&twice) / by_walls(&all) - 2.0).abs() < 0.01 && half(&twice) > 2.0 * half(&all));
    assert!(half(&json(&a, &["walls=0.05"])) < half(&all));
    assert!(half(&json(&b, &["0.05"])) > 1.3 * half(&all));
    // The ends are about those of rooms at the ends of the absorption, where symmetric ones were off by a tenth and more.
    let ends = json(&a, &["walls=0.05"])["receivers"][0]["bands"][0]["t20_s"]["ci95_materials"].clone();
    for (end, absorption) in [(0, "0.298"), (1, "0.102")] {
        let (name, set) = (format!("end{end}.npz"), format!("materials.walls.absorption={absorption}"));
        render(&folder, "room.sonelmap", &name, &[&rays[..], &["--set", &set]].concat()).unwrap();
        let (text, _) =
            analyze(&["parameters", &folder.path(&name).display().to_string(), "--format", "json"]).unwrap();
        let rendered: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let time = rendered["receivers"][0]["bands"][0]["t20_s"]["value"].as_f64().expect("a time");
        let ratio = ends[end].as_f64().expect("an end") / time;
        assert!((ratio - 1.0).abs() < 0.06, "{ends}: {ratio} of {time}");
    }
    // A fifth of 0.2 and of 0.5 at 250 Hz.
    let relative = json(&a, &["20%"]);
    assert_eq!(relative["material_uncertainty"][1]["absorption"][0], 0.1);
    let (csv, _) = ask(&a, &map, &["0.05", "--format", "csv", "--mean"]).unwrap();
    assert!(csv.lines().next().unwrap().ends_with("reason,ci95_materials_low,ci95_materials_high"), "{csv}");
    let (table, _) = ask(&a, &map, &["walls=0.15"]).unwrap();
    assert!(table.contains("α ± 1.96 u of \"walls\" is cut at an end of its range"), "{table}");

    assert!(ask(&a, &other, &["0.05"]).unwrap_err().contains("was not rendered from"));
    assert!(ask(&a, &map, &["roof=0.05"]).unwrap_err().contains("it has \"walls\", \"z0\""));
    assert!(ask(&a, &map, &["walls=0.05,0.1"]).unwrap_err().contains("the scene has 3 bands"));
    assert!(ask(&a, &map, &["walls=0.7"]).unwrap_err().contains("0 … 0.5"));
    assert!(ask(&a, &map, &["0.1", "--material-uncertainty", "0.2"]).unwrap_err().contains("given twice"));
    for nothing in ["0", "1e-320", "walls=1e-300"] {
        ask(&a, &map, &[nothing]).unwrap();
    }
    assert!(analyze(&["parameters", &a, "--material-uncertainty", "0.1"]).unwrap_err().contains("--map"));
}
