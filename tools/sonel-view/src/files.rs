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
    /// Maps and their files.
    pub maps: Vec<(PathBuf, Map)>,
    /// Responses with the names of their files.
    pub responses: Vec<(String, Response)>,
}

impl Files {
    /// Opens all `files`; a scene is not read yet.
    ///
    /// # Errors
    /// When one cannot be read or is damaged; two scenes, a map twice, or a scene and a map.
    pub(crate) fn open(files: &[PathBuf]) -> anyhow::Result<Self> {
        let mut opened = Self { scene: None, maps: Vec::new(), responses: Vec::new() };
        for path in files {
            match artifact::kind(path)? {
                Some(Artifact::Response) => {
                    let response = Response::open(path).map_err(spelled)?;
                    opened.responses.push((name(&response, path, &opened.responses), response));
                }
                Some(Artifact::Map) => {
                    let map = checked(path)?;
                    let digest = map.sonels().digest();
                    if opened.maps.iter().any(|(_, known)| known.sonels().digest() == digest) {
                        bail!("{} is given twice: give each map once", path.display())
                    }
                    opened.maps.push((path.clone(), map));
                }
                None if opened.scene.is_some() => bail!("{} is a second scene: give one", path.display()),
                None => opened.scene = Some(path.clone()),
            }
        }
        if opened.scene.is_some() && !opened.maps.is_empty() {
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

    /// Responses and their maps: what is missing is traced with `packets` and rendered at the receivers of the scene.
    ///
    /// # Errors
    /// When the scene is invalid, or the first response is of no scene of a map.
    pub(crate) fn rendered(
        self,
        packets: Option<u64>,
        heard: &HeardArguments,
        follower: &Follower<'_>,
    ) -> anyhow::Result<(Vec<Subject>, Vec<Map>)> {
        let Self { scene, maps, mut responses } = self;
        let mut maps: Vec<Map> = maps.into_iter().map(|(_, map)| map).collect();
        if let Some(path) = scene {
            let scene = follower.result(Scene::load(&path, follower))?;
            let options = TraceOptions { packets, ..TraceOptions::default() };
            maps.push(follower.result(scene.trace(&options, follower))?.map);
        }
        if maps.is_empty() && responses.is_empty() {
            bail!("no response among the files: make one from a map with sonel-render");
        }
        if responses.is_empty() {
            for map in &maps {
                let rendered = follower.result(map.render(&[], &RenderOptions::default(), follower))?;
                responses.push((map.sonels().header().scene.name.clone(), rendered.response));
            }
        }
        if !maps.is_empty() {
            let named = responses.iter().map(|(name, response)| (name.as_str(), response.echograms()));
            let scenes: Vec<_> = maps.iter().map(|map| &map.sonels().header().scene).collect();
            artifact::check_scene(named, &scenes, &mut |text| follower.line(text))?;
        }
        let subject = |(name, response)| Subject::new(name, response, heard);
        Ok((responses.into_iter().map(subject).collect::<anyhow::Result<_>>()?, maps))
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
