//! Drawings read back as XML: what is in them, and in which colours; panels of responses with known answers.

use std::collections::BTreeMap;

use roxmltree::Document;
use sonel_echogram::{Arrivals, Batches, Response};

use super::*;
use sonel_analysis::Parameter;

/// The drawing of `sheet` as text, after checking that it is XML.
fn drawn(sheet: &Sheet) -> String {
    let mut out = Vec::new();
    svg(sheet, &mut out).unwrap();
    let text = String::from_utf8(out).unwrap();
    Document::parse(&text).unwrap();
    text
}

/// Elements by name and colour, without the white page and the grey mesh.
fn elements(text: &str) -> BTreeMap<(String, String), usize> {
    let document = Document::parse(text).unwrap();
    let mut counts = BTreeMap::new();
    for node in document.descendants().filter(|node| node.is_element()) {
        let color = |key| node.attribute(key).filter(|value| *value != "none");
        let is_faint = node.attribute("opacity").is_some_and(|opacity| opacity == "0.15");
        if let Some(color) = color("stroke").or_else(|| color("fill")).filter(|_| !is_faint) {
            *counts.entry((node.tag_name().name().to_owned(), color.to_owned())).or_insert(0) += 1;
        }
    }
    counts
}

fn count(text: &str, tag: &str, color: &str) -> usize {
    elements(text).get(&(tag.to_owned(), color.to_owned())).copied().unwrap_or(0)
}

fn panel(series: Vec<Series>) -> Panel {
    Panel {
        title: "Errors & <gaps>".to_owned(),
        x: Axis::logarithmic("time [s]"),
        y: Axis::linear("level [dB]"),
        series,
    }
}

fn line(name: &str, mark: Mark) -> Series {
    let points = (1..=5).map(|i| Point::within(f64::from(i), 0.1 * f64::from(i), 0.02)).collect();
    Series::new(name, mark, points)
}

/// The second and the third colour: the first is that of axes and letters.
const SECOND: &str = "#D55E00";
const THIRD: &str = "#0072B2";

#[test]
fn every_series_is_drawn_once_and_named_once() {
    let series = vec![line("first", Mark::Line), line("bars", Mark::PointsAndLine), line("band", Mark::Line)];
    let text = drawn(&Sheet::new("All", vec![vec![panel(series.clone()), panel(series)]]));
    // A line in each of two panels and one in the legend.
    assert_eq!(count(&text, "polyline", SECOND) + count(&text, "line", SECOND), 3 + 2 * 5 * 3, "{text}");
    // A circle a point, another of the bar, one in the legend.
    assert_eq!(count(&text, "circle", SECOND), 2 * 5 * 2 + 1);
    assert_eq!((count(&text, "polyline", THIRD), count(&text, "polygon", THIRD)), (3, 2));
    for name in ["first", "bars", "band"] {
        let document = Document::parse(&text).unwrap();
        let named = document.descendants().filter(|node| node.text().is_some_and(|text| text.trim() == name));
        assert_eq!(named.filter(|node| node.is_element()).count(), 1, "{name}");
    }
    assert!(
        text.contains("time [s]")
            && text.contains("level [dB]")
            && text.contains("Errors &amp; &lt;gaps&gt;")
    );
}

#[test]
fn what_has_no_value_leaves_a_gap() {
    let mut broken = line("broken", Mark::Line);
    broken.points[2].y = f64::NAN;
    let text = drawn(&Sheet::single(panel(vec![line("whole", Mark::Line), broken])));
    // Two pieces and the sample in the legend; the whole line would be one and the sample.
    assert_eq!(count(&text, "polyline", SECOND), 3);
    let mut impossible = line("x", Mark::Line);
    impossible.points.iter_mut().for_each(|point| point.x = -1.0);
    let text = drawn(&Sheet::single(panel(vec![line("whole", Mark::Line), impossible])));
    assert_eq!(count(&text, "polyline", SECOND), 1, "only the sample in the legend");
}

#[test]
fn nothing_is_an_empty_page_and_many_series_have_colours_of_their_own() {
    drawn(&Sheet::single(panel(Vec::new())));
    drawn(&Sheet::new("", Vec::new()));
    let many: Vec<Series> = (0..30).map(|i| line(&format!("{i} Hz"), Mark::Line)).collect();
    let text = drawn(&Sheet::single(panel(many)));
    let polygons = elements(&text).into_iter().filter(|((tag, _), _)| tag == "polygon").count();
    assert_eq!(polygons, 30, "bands of as many colours");
}

#[test]
fn a_page_claims_half_of_the_pixels_it_is_drawn_on() {
    let text = drawn(&Sheet::single(panel(vec![line("a", Mark::Points)])));
    let document = Document::parse(&text).unwrap();
    let size = |key| document.root_element().attribute(key).unwrap().to_owned();
    assert_eq!(size("width"), "1000");
    assert!(size("viewBox").starts_with("0 0 2000 "), "{}", size("viewBox"));
}

const RATE: f64 = 10.0;

/// An exponential decay whose batches are all of it, times a factor each.
fn response(factors: &[f32]) -> Response {
    let time_edges_s: Vec<f64> = (0..=1000).map(|edge| f64::from(edge) * 0.002).collect();
    let between = |pair: &[f64]| (-RATE * pair[0]).exp() - (-RATE * pair[1]).exp();
    let coarse: Vec<f64> = (0..=100).map(|edge| f64::from(edge) * 0.02).collect();
    let batch =
        |factor: &f32| -> Vec<f32> { coarse.windows(2).map(|pair| factor * between(pair) as f32).collect() };
    Response {
        center_frequency_hz: vec![1000.0],
        energy: time_edges_s.windows(2).map(between).collect(),
        time_edges_s,
        receiver_names: vec!["seat".to_owned()],
        receiver_positions: vec![[0.0; 3]],
        receiver_directivities: Vec::new(),
        source_names: vec!["stage".to_owned()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![90.0],
        speed_of_sound: 343.0,
        characteristic_impedance: 413.0,
        direct_times_s: Vec::new(),
        batches: Some(Batches {
            weight: vec![1.0 / factors.len() as f64; factors.len()],
            bins: coarse.len() - 1,
            energy: factors.iter().flat_map(batch).collect(),
            time_edges_s: coarse,
            kernel_difference: Vec::new(),
        }),
        missing: None,
        arrivals: Arrivals::default(),
        directions: None,
        provenance: Default::default(),
    }
}

/// Student's t for four batches times the standard error of factors 0.9, 1, 1, 1.1.
const HALF_WIDTH: f64 = 3.182_446 * 0.040_825;

#[test]
fn an_echogram_has_the_fluence_rate_of_the_decay_and_the_interval_of_its_batches() {
    let panel = echogram(&response(&[0.9, 1.0, 1.0, 1.1]), 0, 0);
    let point = panel.series[0].points[10];
    let rate = ((-RATE * 0.2).exp() - (-RATE * 0.22).exp()) / 0.02;
    assert!((point.x - 0.21).abs() < 1e-9 && (point.y - 10.0 * rate.log10()).abs() < 1e-5, "{point:?}");
    let interval = point.interval.unwrap();
    for (end, factor) in interval.into_iter().zip([1.0 - HALF_WIDTH, 1.0 + HALF_WIDTH]) {
        assert!((end - point.y - 10.0 * factor.log10()).abs() < 1e-3, "{interval:?}");
    }
    let without = echogram(&Response { batches: None, ..response(&[1.0]) }, 0, 0);
    assert!(without.series[0].points.iter().all(|point| point.interval.is_none()));
    assert_eq!(without.series[0].points.len(), 250);
}

#[test]
fn a_decay_falls_as_the_energy_does_and_a_common_factor_is_no_spread_of_it() {
    let panel = decay(&response(&[0.9, 1.0, 1.0, 1.1]), 0, 0);
    let point = panel.series[0].points[50];
    assert!((point.x - 0.4).abs() < 1e-9);
    assert!((point.y - 10.0 * (-RATE * 0.4).exp().log10()).abs() < 1e-6, "{point:?}");
    assert!(point.interval.is_some_and(|[low, high]| high - low < 1e-4), "{point:?}");
    let mut uneven = response(&[0.9, 1.0, 1.0, 1.1]);
    let batches = uneven.batches.as_mut().unwrap();
    batches.energy[..10].iter_mut().for_each(|energy| *energy *= 2.0);
    let point = decay(&uneven, 0, 0).series[0].points[50];
    assert!(point.interval.is_some_and(|[low, high]| high - low > 0.5), "{point:?}");
}

#[test]
fn a_panel_of_each_parameter_shows_its_value_and_leaves_out_what_was_refused() {
    let mut short = response(&[0.9, 1.0, 1.0, 1.1]);
    short.time_edges_s.truncate(251);
    short.energy.truncate(250);
    let figures =
        [sonel_analysis::parameters(&response(&[0.9, 1.0, 1.0, 1.1])), sonel_analysis::parameters(&short)];
    let panels = parameters(&[("whole".to_owned(), &figures[0][0]), ("short".to_owned(), &figures[1][0])]);
    assert_eq!(panels.len(), Parameter::ALL.len());
    let panel = &panels[Parameter::EarlyDecayTime as usize];
    assert_eq!(panel.y.label, "EDT [s]");
    assert!((panel.series[0].points[0].y - 6.0 * std::f64::consts::LN_10 / RATE).abs() < 1e-6);
    // Its batches have bins of 20 ms.
    assert!(panels[Parameter::CenterTime as usize].series[0].points[0].y.is_nan());
    assert!(panels[Parameter::T30 as usize].series[1].points[0].y.is_nan());
    drawn(&Sheet::new("", panels.chunks(3).map(<[Panel]>::to_vec).collect()));
}

/// Two plans: a grid of three by two whose last cell has no value, and a single dot.
fn plans() -> Plans {
    let place = |i: u32| PlanPoint {
        position: [f64::from(i % 3), f64::from(i / 3), 1.2],
        value: (i < 5).then_some(f64::from(i)),
    };
    let grid: Vec<PlanPoint> = (0..6).map(place).collect();
    let plane = super::plan::Section::of(&grid.iter().map(|place| place.position).collect::<Vec<_>>(), 2);
    let walls = vec![[[-0.5, -0.5], [2.5, -0.5]], [[2.5, -0.5], [2.5, 1.5]]];
    let full = Plan { walls, sources: vec![[0.2, 0.3]], ..plane.plan("grid".to_owned(), &grid) };
    let seat = [PlanPoint { position: [1.0, 1.0, 1.2], value: Some(2.5) }];
    Plans { scale: Axis::linear("C80 [dB]"), each: vec![full, plane.plan("seat".to_owned(), &seat)] }
}

#[test]
fn a_plan_has_a_cell_of_its_colour_for_each_receiver_its_walls_and_one_bar() {
    let text = drawn(&Sheet { plans: Some(plans()), ..Sheet::default() });
    let document = Document::parse(&text).unwrap();
    let rectangles: Vec<_> = document.descendants().filter(|node| node.tag_name().name() == "rect").collect();
    let of_color =
        |color: &str| rectangles.iter().filter(|node| node.attribute("fill") == Some(color)).count();
    assert_eq!(of_color("#C8C8C8"), 1, "the cell without a value");
    let sides: Vec<f64> = rectangles
        .iter()
        .filter(|node| node.attribute("fill") == Some("#C8C8C8"))
        .flat_map(|node| ["width", "height"].map(|key| node.attribute(key).unwrap().parse::<f64>().unwrap()))
        .collect();
    assert!((sides[0] - sides[1]).abs() <= 1.0, "a metre is as long across as up: {sides:?}");
    assert!(count(&text, "polyline", "#000000") + count(&text, "line", "#000000") > 2);
    assert!(text.contains("C80 [dB]") && text.matches("C80 [dB]").count() == 1);
    assert!(text.contains("2.5"), "a dot has its value as text");
    let seats = document.descendants().filter(|node| node.tag_name().name() == "circle").count();
    assert_eq!(seats, 2, "the dot and its border");
}

/// Eight plans side by side: names end in an ellipsis, and labels of an axis do not touch.
#[test]
fn narrow_plans_have_short_titles_and_few_ticks() {
    let plan = || {
        let mut plan = plans().each.swap_remove(0);
        plan.title = "T30, single number: a long name of a variant".to_owned();
        plan.spots.iter_mut().for_each(|spot| {
            spot.at[0] += 1e4;
            spot.cell = spot.cell.map(|corners| corners.map(|[x, y]| [x + 1e4, y]));
        });
        plan.walls.clear();
        plan.sources.clear();
        plan
    };
    let labels = |count: usize| {
        let each = (0..count).map(|_| plan()).collect();
        let text =
            drawn(&Sheet { plans: Some(Plans { scale: Axis::linear("T30 [s]"), each }), ..Sheet::default() });
        (
            text.matches("a long name of a variant").count(),
            text.matches('…').count(),
            ["1000", "9999"].map(|begin| text.matches(begin).count()).iter().sum::<usize>(),
        )
    };
    let (alone, many) = (labels(1), labels(8));
    assert_eq!((alone.0, alone.1, many.0, many.1), (1, 0, 0, 8));
    assert!(many.2 >= 8 && many.2 < 8 * alone.2, "{alone:?} {many:?}");
}

#[test]
fn plans_of_nothing_and_of_one_place_are_drawn() {
    let none = Plan {
        title: String::new(),
        axes: Default::default(),
        spots: Vec::new(),
        walls: Vec::new(),
        sources: Vec::new(),
        hidden: 0,
    };
    for each in [vec![none.clone()], vec![none.clone(), none], vec![plans().each.swap_remove(1)], Vec::new()]
    {
        drawn(&Sheet { plans: Some(Plans { scale: Axis::linear("G [dB]"), each }), ..Sheet::default() });
    }
}

/// Pixels of a PNG by colour.
fn colors(sheet: &Sheet) -> (u32, BTreeMap<[u8; 3], usize>) {
    let mut file = Vec::new();
    png(sheet, &mut file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut bytes).unwrap().width;
    let mut counts = BTreeMap::new();
    for pixel in bytes.chunks_exact(3) {
        *counts.entry([pixel[0], pixel[1], pixel[2]]).or_insert(0) += 1;
    }
    (width, counts)
}

#[test]
fn a_png_has_the_lines_cells_and_letters_of_the_svg() {
    let (width, counts) = colors(&Sheet { plans: Some(plans()), ..Sheet::default() });
    assert_eq!(width, 2000);
    let cell = counts[&[200, 200, 200]];
    assert!(cell > 10_000, "the cell without a value: {cell}");
    let (_, empty) = colors(&Sheet::single(panel(Vec::new())));
    let (_, lines) = colors(&Sheet::single(panel(vec![line("a", Mark::Line), line("b", Mark::Line)])));
    let orange = [213, 94, 0];
    assert!(lines.get(&orange).is_some_and(|count| *count > 1000) && !empty.contains_key(&orange));
    let (_, untitled) = colors(&Sheet::single(Panel { title: String::new(), ..panel(Vec::new()) }));
    assert!(empty[&[0; 3]] > untitled[&[0; 3]] + 500, "letters are drawn");
}

/// Direct sound at 10 ms and a reflection of a tenth of its energy 20 ms later, over an edge another 5 ms later.
fn listed() -> Response {
    let arrivals = Arrivals {
        source: vec![0; 3],
        receiver: vec![0; 3],
        time_s: vec![0.010, 0.030, 0.035],
        energy: vec![1e-3, 1e-4, 1e-6],
        direction: vec![1.0; 9],
        order: vec![0, 1, 0],
        kind: vec![0, 1, 2],
    };
    Response { arrivals, receiver_positions: vec![[3.43, 0.0, 0.0]], ..response(&[1.0]) }
}

#[test]
fn early_reflections_are_stems_by_order_with_their_part_of_the_strength() {
    let panel = early(&listed(), (0, 0), Some(0)).unwrap();
    let names: Vec<&str> = panel.series.iter().map(|series| series.name.as_str()).collect();
    assert_eq!(names, ["direct sound", "direct sound over an edge", "1 reflection"]);
    let reflection = panel.series[2].points[0];
    assert!((reflection.x - 20.0).abs() < 1e-9);
    assert!((reflection.y - 10.0 * (400.0 * std::f64::consts::PI * 1e-4).log10()).abs() < 1e-9);
    assert_eq!(early(&listed(), (0, 0), None).unwrap().series, panel.series, "one band is all bands");
    let text = drawn(&Sheet::single(panel));
    // A stem, a point and the sample in the legend.
    assert_eq!(count(&text, "line", THIRD) + count(&text, "polyline", THIRD), 1, "{text}");
    assert_eq!(count(&text, "circle", THIRD), 2);
}

#[test]
fn without_direct_sound_delays_count_from_where_it_would_be_and_without_arrivals_there_is_no_panel() {
    let mut blocked = listed();
    blocked.arrivals.time_s[1] = 0.4;
    blocked.arrivals.energy[0] = 0.0;
    blocked.arrivals.energy[2] = 0.0;
    let panel = early(&blocked, (0, 0), None).unwrap();
    assert!(panel.x.range.is_some_and(|[_, last]| last > 390.0));
    assert!((panel.series.last().unwrap().points[0].x - 390.0).abs() < 1e-9);
    blocked.arrivals.energy[1] = 0.0;
    assert_eq!(early(&blocked, (0, 0), None), None);
    assert_eq!(early(&response(&[1.0]), (0, 0), None), None);
}
