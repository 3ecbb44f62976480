//! The files that a page is made of.

use std::path::{Path, PathBuf};

use anyhow::bail;
use sonel::echograms::Provenance;
use sonel::{Map, RenderOptions, Response, Scene, TraceOptions};
use sonel_console::artifact::{self, Artifact};
use sonel_console::follower::Follower;
use sonel_console::heard::HeardArguments;
use sonel_console::spelled;

use crate::page::Subject;

/// What was given.
pub(crate) struct Files {
    /// The scene file.
    pub scene: Option<PathBuf>,
    /// The map and its file.
    pub map: Option<(PathBuf, Map)>,
    /// Responses with the names of their files.
    pub responses: Vec<(String, Response)>,
}

impl Files {
    /// Opens all `files`; a scene is not read yet.
    ///
    /// # Errors
    /// When one cannot be read or is damaged; two scenes or maps, or both.
    pub(crate) fn open(files: &[PathBuf]) -> anyhow::Result<Self> {
        let mut opened = Self { scene: None, map: None, responses: Vec::new() };
        for path in files {
            match artifact::kind(path)? {
                Some(Artifact::Response) => {
                    let response = Response::open(path).map_err(spelled)?;
                    opened.responses.push((name(&response, path, &opened.responses), response));
                }
                Some(Artifact::Map) if opened.map.is_some() => {
                    bail!("{} is a second map: give the map of the first response alone", path.display())
                }
                Some(Artifact::Map) => opened.map = Some((path.clone(), checked(path)?)),
                None if opened.scene.is_some() => bail!("{} is a second scene: give one", path.display()),
                None => opened.scene = Some(path.clone()),
            }
        }
        if opened.scene.is_some() && opened.map.is_some() {
            bail!("a scene and a map: give the scene, which is traced, or the map");
        }
        opened.call_by_scene();
        Ok(opened)
    }

    /// Beside variants, the response of the scene itself is called as the scene.
    fn call_by_scene(&mut self) {
        if self.responses.iter().all(|(_, response)| response.echograms().provenance.variant.is_none()) {
            return;
        }
        for at in 0..self.responses.len() {
            let Provenance { scene, variant, .. } = &self.responses[at].1.echograms().provenance;
            let scene = scene.clone().filter(|_| variant.is_none());
            let is_free = |name: &String| self.responses.iter().all(|(other, _)| other != name);
            if let Some(scene) = scene.filter(is_free) {
                self.responses[at].0 = scene;
            }
        }
    }

    /// Responses and their map: what is missing is traced with `packets` and rendered at the receivers of the scene.
    ///
    /// # Errors
    /// When the scene is invalid, or the first response is of another scene than the map.
    pub(crate) fn rendered(
        self,
        packets: Option<u64>,
        heard: &HeardArguments,
        follower: &Follower<'_>,
    ) -> anyhow::Result<(Vec<Subject>, Option<Map>)> {
        let Self { scene, map, mut responses } = self;
        let traced = |path: PathBuf| -> anyhow::Result<Map> {
            let scene = follower.result(Scene::load(&path, follower))?;
            let options = TraceOptions { packets, ..TraceOptions::default() };
            Ok(follower.result(scene.trace(&options, follower))?.map)
        };
        if map.is_none() && scene.is_none() && responses.is_empty() {
            bail!("no response among the files: make one from a map with sonel-render");
        }
        let map = match (map, scene) {
            (Some((_, map)), _) => Some(map),
            (None, Some(scene)) => Some(traced(scene)?),
            (None, None) => None,
        };
        if let (Some(map), true) = (&map, responses.is_empty()) {
            let rendered = follower.result(map.render(&[], &RenderOptions::default(), follower))?;
            responses.push((map.sonels().header().scene.name.clone(), rendered.response));
        }
        if let Some(map) = &map {
            let named = responses.iter().map(|(name, response)| (name.as_str(), response.echograms()));
            artifact::check_scene(named, &map.sonels().header().scene, &mut |text| follower.line(text))?;
        }
        let subject = |(name, response)| Subject::new(name, response, heard);
        Ok((responses.into_iter().map(subject).collect::<anyhow::Result<_>>()?, map))
    }
}

/// What the page calls a response: its variant, unless another one has this name; else the name of its file.
fn name(response: &Response, path: &Path, others: &[(String, Response)]) -> String {
    let variant = response.echograms().provenance.variant.as_deref();
    let is_free = |name: &&str| others.iter().all(|(other, _)| other != name);
    variant.filter(is_free).map_or_else(|| artifact::stem(path), str::to_owned)
}

fn checked(path: &Path) -> anyhow::Result<Map> {
    let map = Map::open(path).map_err(spelled)?;
    map.check().map_err(spelled)?;
    Ok(map)
}
