//! Estimator used for each path class, and the reason.

use super::Renderer;
use crate::path_class::PathClass;
use crate::settings::Estimator;

impl Renderer<'_> {
    /// The classes that paths of this map can be of.
    pub fn path_classes(&self) -> impl Iterator<Item = PathClass> {
        PathClass::ALL
            .into_iter()
            .filter(|class| *class != PathClass::Refracted || self.prepared.airs.are_several())
    }

    /// The estimator that owns `class`.
    #[must_use]
    pub fn owner(&self, class: PathClass) -> &'static str {
        if let Some(paper) = &self.prepared.paper {
            return paper.owner(class);
        }
        match class {
            PathClass::Direct if !self.prepared.table.propagation().is_straight() => {
                "shadow ray along an arc"
            }
            PathClass::Direct => "shadow ray",
            PathClass::ImageSource => "image sources",
            PathClass::Edge => "edges",
            PathClass::Refracted => "receiver sphere",
            PathClass::LateSpecular if self.casts_specular_rays() => {
                "specular rays into receiver spheres, to image sources where sound is focused"
            }
            PathClass::Diffuse if self.prepared.gather.is_some() => {
                "connection, near surfaces shared with rays"
            }
            PathClass::Diffuse
                if self.connects_diffuse() && !self.prepared.table.propagation().is_straight() =>
            {
                "connection along an arc"
            }
            PathClass::Diffuse if self.connects_diffuse() => "connection",
            PathClass::DiffuseMirror if self.gathers_by_mirrors() => "gather",
            PathClass::DiffuseMirror => "connection to images of the receiver",
            _ => "receiver sphere",
        }
    }

    /// Why [`Self::owner`] owns `class`, where the image-source paths were enumerated up to `mirror_order`.
    #[must_use]
    pub fn reason(&self, class: PathClass, mirror_order: u32) -> String {
        if let Some(paper) = &self.prepared.paper {
            return paper.reason(class);
        }
        if let Some(reason) = self.reason_of_arcs(class) {
            return reason.to_owned();
        }
        let forced = self.prepared.settings.estimator != Estimator::Auto;
        match class {
            PathClass::Direct => "exact".to_owned(),
            PathClass::ImageSource => format!("exact: enumerated completely up to order K = {mirror_order}"),
            PathClass::Refracted => "no straight path passes an interface".to_owned(),
            PathClass::Edge if !self.prepared.edges.is_empty() => {
                "rigid faces, first order, and second over thick barriers".to_owned()
            }
            PathClass::Edge => "diffraction is off or no edge diffracts".to_owned(),
            PathClass::LateSpecular => {
                format!(
                    "image-source paths beyond order K = {mirror_order} are too many or were not requested"
                )
            }
            _ if forced => "requested".to_owned(),
            PathClass::Diffuse => "unbiased, low noise except near a surface".to_owned(),
            PathClass::DiffuseMirror if self.gathers_by_mirrors() => {
                "low noise in any room; in an empty box images of the receiver have less".to_owned()
            }
            PathClass::DiffuseMirror => {
                "unbiased: the images of an empty box are all visible, those that lose little".to_owned()
            }
            PathClass::LongDiffuseMirror if self.gathers_by_mirrors() => {
                "empty: visibility rays follow specular reflections to any order".to_owned()
            }
            PathClass::LongDiffuseMirror => "images of the receiver that lose much are too many".to_owned(),
        }
    }

    /// Why the estimator of a class is another one where the speed of sound has a gradient.
    pub(crate) fn reason_of_arcs(&self, class: PathClass) -> Option<&'static str> {
        match class {
            _ if self.prepared.table.propagation().is_straight() => None,
            PathClass::Direct | PathClass::Diffuse | PathClass::Refracted => None,
            PathClass::Edge if self.prepared.edges.is_empty() => None,
            PathClass::Edge => Some(
                "direct sound only, as in even air: where paths bend, levels behind edges may be decibels off",
            ),
            PathClass::ImageSource => Some("along arcs those at one level are computed"),
            _ => Some("other image sources are not computed along arcs"),
        }
    }
}
