//! The same command gives the same bytes, whatever the number of threads, and receivers do not influence each other.

use crate::{render, response, test_folder, trace};

fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let folder = test_folder();
    for threads in [1, 2, 3, 7] {
        in_pool(threads, || {
            trace(&folder, &format!("{threads}.sonelmap"), &["--packets", "3k"]).unwrap();
            render(&folder, &format!("{threads}.sonelmap"), &format!("{threads}.npz"), &[]).unwrap();
        });
        assert!(
            folder.bytes("1.sonelmap") == folder.bytes(&format!("{threads}.sonelmap")),
            "map, {threads} threads"
        );
        assert!(
            folder.bytes("1.npz") == folder.bytes(&format!("{threads}.npz")),
            "response, {threads} threads"
        );
    }
}

#[test]
fn another_seed_is_another_map_with_another_response() {
    let folder = test_folder();
    trace(&folder, "1.sonelmap", &["--packets", "2k"]).unwrap();
    trace(&folder, "2.sonelmap", &["--packets", "2k", "--seed", "2"]).unwrap();
    render(&folder, "1.sonelmap", "1.npz", &[]).unwrap();
    render(&folder, "2.sonelmap", "2.npz", &[]).unwrap();
    assert!(response(&folder, "1.npz").energy != response(&folder, "2.npz").energy);
}

#[test]
fn rendering_leaves_the_map_alone() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).unwrap();
    let (before, written) =
        (folder.bytes("a.sonelmap"), folder.path("a.sonelmap").metadata().unwrap().modified().unwrap());
    render(&folder, "a.sonelmap", "a.npz", &[]).unwrap();
    render(&folder, "a.sonelmap", "b.npz", &["--receiver", "elsewhere=1.5,3,1"]).unwrap();
    assert!(before == folder.bytes("a.sonelmap"));
    assert_eq!(written, folder.path("a.sonelmap").metadata().unwrap().modified().unwrap());
    assert!(response(&folder, "a.npz").energy != response(&folder, "b.npz").energy);
}

/// More receivers than one sweep takes, so that the border between sweeps is crossed.
#[test]
fn receivers_of_a_hundred_in_one_call_are_what_they_are_alone() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "400"]).unwrap();
    let places: Vec<String> = (0..100)
        .map(|i| format!("r{i}={},{},1.4", 0.5 + 0.04 * f64::from(i), 3.5 - 0.03 * f64::from(i)))
        .collect();
    let options: Vec<&str> = places.iter().flat_map(|place| ["--receiver", place]).collect();
    render(&folder, "a.sonelmap", "all.npz", &options).unwrap();
    let all = response(&folder, "all.npz");
    for (index, place) in places.iter().enumerate().step_by(7) {
        render(&folder, "a.sonelmap", "one.npz", &["--receiver", place]).unwrap();
        let one = response(&folder, "one.npz");
        for band in 0..3 {
            let (together, alone) = (all.echogram(0, index, band), one.echogram(0, 0, band));
            assert!(
                together.iter().zip(alone).all(|(a, b)| a.to_bits() == b.to_bits()),
                "{place}, band {band}"
            );
            for batch in 0..all.batch_count() {
                assert_eq!(all.batch_echogram(batch, 0, index, band), one.batch_echogram(batch, 0, 0, band));
            }
        }
    }
}

/// The weighted mean of the batches is the energy, class shares add up to it, and the report is what was promised.
#[test]
fn the_parts_of_a_response_add_up() {
    let folder = test_folder();
    let traced: serde_json::Value =
        serde_json::from_str(&trace(&folder, "a.sonelmap", &["--packets", "2001", "--json"]).unwrap())
            .unwrap();
    assert_eq!(traced["emitted"], 2001);
    assert_eq!(traced["fates"]["lost"], 0);
    assert_eq!(traced["ledger"].as_array().unwrap().len(), 3);
    assert_eq!(traced["effects"].as_array().unwrap().len(), 6);
    let report: serde_json::Value =
        serde_json::from_str(&render(&folder, "a.sonelmap", "a.npz", &["--json"]).unwrap()).unwrap();
    let response = response(&folder, "a.npz");
    let batches = response.batches.as_ref().unwrap();
    assert!((batches.weight.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    for band in 0..3 {
        let total: f64 = response.echogram(0, 0, band).iter().sum();
        let of_batches: f64 = (0..response.batch_count())
            .map(|g| {
                let sum: f64 =
                    response.batch_echogram(g, 0, 0, band).unwrap().iter().map(|&e| f64::from(e)).sum();
                batches.weight[g] * sum
            })
            .sum();
        assert!((of_batches / total - 1.0).abs() < 1e-5, "band {band}: {of_batches} and {total}");
        let classes = report["sources"][0]["classes"].as_array().unwrap();
        for class in classes {
            let samples = class["effective_sample_size"][0][band].as_f64();
            let scatters = ["... D R", "... D S^k R"].contains(&class["class"].as_str().unwrap());
            assert!(if scatters {
                samples.unwrap() > 100.0
            } else {
                samples.is_none_or(|samples| samples > 0.0)
            });
            assert!(!class["reason"].as_str().unwrap().is_empty());
        }
        let of_classes: f64 = classes.iter().map(|class| class["energy"][0][band].as_f64().unwrap()).sum();
        assert!((of_classes / total - 1.0).abs() < 1e-9, "band {band}: {of_classes} and {total}");
    }
}
