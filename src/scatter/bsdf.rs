//! The scattering function at a surface point: up to [`MAX_LOBES`] lobes in one shading frame.

use arrayvec::ArrayVec;

use crate::math::{Frame, Normal3, Vec3};
use crate::sampling::rng::ONE_MINUS_EPSILON;
use crate::scatter::bssrdf::SubsurfaceExit;
use crate::scatter::diffuse::{Diffuse, DiffuseTransmission};
use crate::scatter::disney::{Clearcoat, DisneyBase};
use crate::scatter::fourier::FourierTable;
use crate::scatter::fresnel::Fresnel;
use crate::scatter::fresnel_blend::FresnelBlend;
use crate::scatter::hair::Hair;
use crate::scatter::rough_dielectric::RoughDielectric;
use crate::scatter::rough_reflection::RoughReflection;
use crate::scatter::same_hemisphere;
use crate::scatter::specular::{
    Mirror, PassThrough, SmoothDielectric, SpecularPart, SpecularSample,
};
use crate::spectrum::Rgb;

/// What travels along the path: radiance from lights, or importance from the camera.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TransportMode {
    /// Paths that start at the camera.
    Radiance,
    /// Paths that start at a light.
    Importance,
}

/// The sides of the surface a lobe scatters to, relative to the side it is seen from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sides {
    /// The same side.
    Reflection,
    /// The other side.
    Transmission,
    /// Both.
    Both,
    /// Both, by values of their own: a pair of directions counts where shading and geometric normal agree on its side.
    Each,
}

impl Sides {
    /// Whether the lobe counts for a pair of directions that is reflected or not by the geometric normal, and by the
    /// shading normal.
    #[inline]
    fn include(self, reflects: bool, reflects_in_shading: bool) -> bool {
        match self {
            Self::Reflection => reflects,
            Self::Transmission => !reflects,
            Self::Both => true,
            Self::Each => reflects == reflects_in_shading,
        }
    }
}

/// One lobe, in the shading frame.
#[derive(Clone, Copy, Debug)]
pub enum Bxdf<'a> {
    /// Diffuse reflection.
    Diffuse(Diffuse),
    /// Diffuse transmission.
    DiffuseTransmission(DiffuseTransmission),
    /// Exit of light that spread below the surface.
    SubsurfaceExit(SubsurfaceExit),
    /// Mirror reflection.
    Mirror(Mirror),
    /// Straight ahead.
    PassThrough(PassThrough),
    /// Smooth dielectric: specular reflection and transmission.
    SmoothDielectric(SmoothDielectric),
    /// Microfacet reflection.
    RoughReflection(RoughReflection),
    /// Microfacet reflection and transmission.
    RoughDielectric(RoughDielectric),
    /// Diffuse base under a rough coat.
    FresnelBlend(FresnelBlend),
    /// A hair fibre.
    Hair(Hair),
    /// A table.
    Fourier(&'a FourierTable),
    /// Diffuse base of the Disney material.
    DisneyBase(DisneyBase),
    /// Clear coat of the Disney material.
    Clearcoat(Clearcoat),
}

impl Bxdf<'_> {
    /// Whether its density is a delta, so that it has no value and no density of its own.
    #[inline]
    pub fn is_specular(&self) -> bool {
        matches!(
            self,
            Self::Mirror(_) | Self::PassThrough(_) | Self::SmoothDielectric(_)
        )
    }

    /// Whether it scatters so evenly that a stored photon tells as much as a ray drawn from it.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        matches!(
            self,
            Self::Diffuse(_)
                | Self::DiffuseTransmission(_)
                | Self::SubsurfaceExit(_)
                | Self::DisneyBase(_)
        )
    }

    /// The sides it scatters to.
    #[inline]
    pub fn sides(&self) -> Sides {
        match self {
            Self::Diffuse(_)
            | Self::SubsurfaceExit(_)
            | Self::Mirror(_)
            | Self::RoughReflection(_)
            | Self::FresnelBlend(_)
            | Self::DisneyBase(_)
            | Self::Clearcoat(_) => Sides::Reflection,
            Self::DiffuseTransmission(_) | Self::PassThrough(_) => Sides::Transmission,
            Self::SmoothDielectric(_) | Self::RoughDielectric(_) => Sides::Each,
            Self::Hair(_) | Self::Fourier(_) => Sides::Both,
        }
    }

    /// Value in sr⁻¹, cosine excluded; black for specular lobes.
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        match self {
            Self::Diffuse(lobe) => lobe.f(wo, wi),
            Self::DiffuseTransmission(lobe) => lobe.f(),
            Self::SubsurfaceExit(lobe) => Rgb::splat(lobe.f(wi, mode)),
            Self::Mirror(_) | Self::PassThrough(_) | Self::SmoothDielectric(_) => Rgb::BLACK,
            Self::RoughReflection(lobe) => lobe.f(wo, wi),
            Self::RoughDielectric(lobe) => lobe.f(wo, wi, mode),
            Self::FresnelBlend(lobe) => lobe.f(wo, wi),
            Self::Hair(lobe) => lobe.f(wo, wi),
            Self::Fourier(table) => table.f(wo, wi, mode),
            Self::DisneyBase(lobe) => lobe.f(wo, wi),
            Self::Clearcoat(lobe) => lobe.f(wo, wi),
        }
    }

    /// Density of [`Bxdf::sample`] in sr⁻¹; 0 for specular lobes.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Diffuse(lobe) => lobe.pdf(wo, wi),
            Self::DiffuseTransmission(lobe) => lobe.pdf(wo, wi),
            Self::SubsurfaceExit(lobe) => lobe.pdf(wi),
            Self::Mirror(_) | Self::PassThrough(_) | Self::SmoothDielectric(_) => 0.0,
            Self::RoughReflection(lobe) => lobe.pdf(wo, wi),
            Self::RoughDielectric(lobe) => lobe.pdf(wo, wi),
            Self::FresnelBlend(lobe) => lobe.pdf(wo, wi),
            Self::Hair(lobe) => lobe.pdf(wo, wi),
            Self::Fourier(table) => table.pdf(wo, wi),
            Self::DisneyBase(lobe) => lobe.pdf(wo, wi),
            Self::Clearcoat(lobe) => lobe.pdf(wo, wi),
        }
    }

    /// For each of the lobes without a delta that pbrt-v3 has in its place, black ones included: calls `add` with a
    /// density in sr⁻¹ with which that lobe draws `wi`, and for how many lobes alike.
    fn pdfs_in_pbrt(&self, wo: Vec3, wi: Vec3, mut add: impl FnMut(f32, u32)) {
        match self {
            Self::Mirror(_) | Self::PassThrough(_) | Self::SmoothDielectric(_) => {}
            Self::RoughReflection(lobe) => add(lobe.pdf_in_pbrt(wo, wi), 1),
            Self::RoughDielectric(lobe) => {
                for pdf in lobe.pdfs_in_pbrt(wo, wi).into_iter().flatten() {
                    add(pdf, 1);
                }
            }
            Self::FresnelBlend(lobe) => add(lobe.pdf_in_pbrt(wo, wi), 1),
            Self::Fourier(table) => add(table.pdf_in_pbrt(wo, wi), 1),
            Self::DisneyBase(lobe) => add(lobe.pdf(wo, wi), lobe.n_lobes_in_pbrt),
            Self::SubsurfaceExit(_)
            | Self::Diffuse(_)
            | Self::DiffuseTransmission(_)
            | Self::Hair(_)
            | Self::Clearcoat(_) => add(self.pdf(wo, wi), 1),
        }
    }

    /// Roughly what part of the light it scatters, at most: by this, lobes are chosen among. Positive unless the lobe
    /// scatters nothing.
    #[inline]
    fn importance(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Diffuse(lobe) => lobe.kd(),
            Self::DiffuseTransmission(lobe) => lobe.kt,
            Self::Mirror(lobe) => lobe.kr,
            Self::PassThrough(lobe) => lobe.kt,
            Self::SmoothDielectric(lobe) => lobe.albedo(wo),
            Self::RoughReflection(lobe) => lobe.importance(wo),
            Self::RoughDielectric(lobe) => lobe.importance(wo),
            Self::FresnelBlend(lobe) => lobe.rd + lobe.rs,
            Self::SubsurfaceExit(_) | Self::Hair(_) | Self::Fourier(_) => Rgb::ONE,
            // Sheen and retro-reflection are bright at grazing angles only.
            Self::DisneyBase(lobe) => lobe.diffuse + lobe.flat + (lobe.retro + lobe.sheen) * 0.25,
            Self::Clearcoat(lobe) => Rgb::splat(lobe.importance(wo)),
        }
    }

    /// What part of the light it scatters at most, where its coefficients tell.
    fn max_albedo(&self) -> Option<Rgb> {
        match self {
            Self::Diffuse(lobe) => lobe.is_lambertian().then(|| lobe.kd()),
            Self::DiffuseTransmission(lobe) => Some(lobe.kt),
            Self::Mirror(lobe) => Some(lobe.kr),
            Self::PassThrough(lobe) => Some(lobe.kt),
            // Facets send on what their Fresnel factor leaves, or less where others are in the way.
            Self::RoughReflection(lobe) => {
                let is_bounded = !matches!(lobe.fresnel, Fresnel::Disney { .. });
                is_bounded.then_some(lobe.r)
            }
            Self::SmoothDielectric(lobe) => Some(lobe.kr + lobe.kt),
            Self::RoughDielectric(_)
            | Self::FresnelBlend(_)
            | Self::SubsurfaceExit(_)
            | Self::Hair(_)
            | Self::Fourier(_)
            | Self::DisneyBase(_)
            | Self::Clearcoat(_) => None,
        }
    }

    /// Draws a direction; `u_part` chooses among the parts of a lobe that has several. `None` where nothing scatters.
    #[inline]
    pub fn sample(
        &self,
        wo: Vec3,
        u_part: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<LobeSample> {
        use LobeSample::{Smooth, Specular};
        match self {
            Self::Diffuse(lobe) => Some(Smooth(lobe.sample(wo, u))),
            Self::DiffuseTransmission(lobe) => Some(Smooth(lobe.sample(wo, u))),
            Self::SubsurfaceExit(lobe) => Some(Smooth(lobe.sample(u))),
            Self::Mirror(lobe) => Some(Specular(lobe.sample(wo))),
            Self::PassThrough(lobe) => Some(Specular(lobe.sample(wo))),
            Self::SmoothDielectric(lobe) => lobe.sample(wo, u_part, mode).map(Specular),
            Self::RoughReflection(lobe) => lobe.sample(wo, u).map(Smooth),
            Self::RoughDielectric(lobe) => lobe.sample(wo, u_part, u).map(Smooth),
            Self::FresnelBlend(lobe) => lobe.sample(wo, u_part, u).map(Smooth),
            Self::Hair(lobe) => lobe.sample(wo, u_part, u).map(Smooth),
            Self::Fourier(table) => table.sample(wo, u_part, u).map(Smooth),
            Self::DisneyBase(lobe) => Some(Smooth(lobe.sample(wo, u))),
            Self::Clearcoat(lobe) => lobe.sample(wo, u).map(Smooth),
        }
    }

    /// All that a specular lobe sends on; nothing of others.
    fn specular_parts(&self, wo: Vec3, mode: TransportMode) -> [Option<SpecularPart>; 2] {
        let only = |sample: SpecularSample, refraction: Option<f32>| {
            let part = SpecularPart {
                wi: sample.wi,
                weight: sample.weight,
                refraction,
            };
            [Some(part), None]
        };
        match self {
            Self::Mirror(lobe) => only(lobe.sample(wo), None),
            Self::PassThrough(lobe) => only(lobe.sample(wo), Some(1.0)),
            Self::SmoothDielectric(lobe) => lobe.parts(wo, mode),
            _ => [None; 2],
        }
    }
}

/// A direction drawn from one lobe, in the shading frame.
#[derive(Clone, Copy, Debug)]
pub enum LobeSample {
    /// From a lobe with a density, [`Bxdf::pdf`].
    Smooth(Vec3),
    /// From a lobe whose density is a delta.
    Specular(SpecularSample),
}

/// A lobe and its factor in a mixture.
#[derive(Clone, Copy, Debug)]
struct Lobe<'a> {
    bxdf: Bxdf<'a>,
    scale: Rgb,
}

/// Cosine between the shading normal and the face's from which on the two horizons count as one.
const NEAR_FACE: f32 = 0.9;
/// Most lobes a surface point may have. A single material has at most 8; mixtures add theirs up.
pub const MAX_LOBES: usize = 16;

/// The probability of each lobe; of as many as there are.
type Chances = [f32; MAX_LOBES];

/// Share of the choice among lobes that all of them have alike, whatever they are thought to scatter.
const CHOSEN_ALIKE: f32 = 0.2;

/// The lobe that `u` falls to, and where in its share.
#[inline]
fn choose(chances: &[f32], u: f32) -> (usize, f32) {
    let mut rest = u;
    for (index, &chance) in chances.iter().enumerate() {
        if rest < chance {
            return (index, (rest / chance).min(ONE_MINUS_EPSILON));
        }
        rest -= chance;
    }
    // By rounding beyond the last share.
    (chances.len() - 1, ONE_MINUS_EPSILON)
}
/// Most ways that specular lobes leave open: one mirrored direction, and for each lobe one that goes through.
pub const MAX_SPECULAR_PARTS: usize = MAX_LOBES + 1;

/// All lobes at a surface point.
#[derive(Clone, Debug)]
pub struct Bsdf<'a> {
    frame: Frame,
    ng: Normal3,
    /// Relative index of refraction that Russian roulette compensates for.
    eta: f32,
    /// Factor of the lobes that are added.
    scale: Rgb,
    lobes: ArrayVec<Lobe<'a>, MAX_LOBES>,
}

/// A direction drawn from a [`Bsdf`].
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Direction in render space.
    pub wi: Vec3,
    /// Throughput factor f |cos θ| / pdf; for specular lobes the limit of that.
    pub weight: Rgb,
    /// Density in sr⁻¹ of all lobes together; 0 for a specular lobe, whose density is a delta.
    pub pdf_w: f32,
    /// The lobe was specular.
    pub specular: bool,
    /// The lobe scatters to the other side of the surface, or did so if it scatters to both.
    pub transmitted: bool,
    /// For a specular transmission: the factor that Russian roulette multiplies its throughput with to undo the
    /// change of solid angle; 1 otherwise.
    pub eta_scale: f32,
}

impl<'a> Bsdf<'a> {
    /// No lobes yet. `frame.n` is the shading normal; there is no interface that Russian roulette heeds.
    pub fn new(frame: Frame, ng: Normal3) -> Self {
        Self {
            frame,
            ng,
            eta: 1.0,
            scale: Rgb::ONE,
            lobes: ArrayVec::new(),
        }
    }

    /// What all lobes together scatter at most, in the brightest channel; infinite where a lobe does not tell.
    pub fn max_albedo(&self) -> f32 {
        let of_lobe = |lobe: &Lobe<'_>| match lobe.bxdf.max_albedo() {
            Some(albedo) => lobe.scale * albedo,
            None => Rgb::splat(f32::INFINITY),
        };
        let sum: Rgb = self.lobes.iter().map(of_lobe).sum();
        sum.max_component()
    }

    /// Sets the relative index of refraction that Russian roulette compensates for.
    pub fn set_eta(&mut self, eta: f32) {
        self.eta = eta;
    }

    /// The relative index of refraction that Russian roulette compensates for.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// The frame of its lobes.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Adds a lobe, unless the current factor is black; beyond [`MAX_LOBES`] it is dropped, which loading rules out.
    pub fn add(&mut self, bxdf: Bxdf<'a>) {
        if self.scale.is_black() {
            return;
        }
        let added = self.lobes.try_push(Lobe {
            bxdf,
            scale: self.scale,
        });
        debug_assert!(added.is_ok());
    }

    /// Lets `add` add lobes that are scaled by `factor`.
    pub fn scaled(&mut self, factor: Rgb, add: impl FnOnce(&mut Self)) {
        let outer = self.scale;
        self.scale = outer * factor;
        add(self);
        self.scale = outer;
    }

    /// Whether light sampling can find anything here.
    #[inline]
    pub fn has_non_specular(&self) -> bool {
        self.lobes.iter().any(|lobe| !lobe.bxdf.is_specular())
    }

    /// The shading normal on the side of `wo` if lobes with a density scatter to that side only; `None` otherwise, and where
    /// that normal is far from the face's: lobes have values beyond its horizon, but draw no directions there.
    #[inline]
    pub fn facing(&self, wo: Vec3) -> Option<Normal3> {
        let reflects =
            |lobe: &Lobe| lobe.bxdf.is_specular() || matches!(lobe.bxdf.sides(), Sides::Reflection);
        if !self.lobes.iter().all(reflects) {
            return None;
        }
        let n = self.frame.n;
        if n.dot(Vec3(self.ng.0)).abs() < NEAR_FACE {
            return None;
        }
        Some(Normal3(if n.dot(wo) < 0.0 { -n.0 } else { n.0 }))
    }

    /// Roughly what part of the light all lobes together scatter, of the channel with the most.
    #[inline]
    pub fn importance(&self, wo: Vec3) -> f32 {
        let wo = self.frame.to_local(wo);
        let lobes = self.lobes.iter();
        let all: Rgb = lobes
            .map(|lobe| lobe.scale * lobe.bxdf.importance(wo))
            .sum();
        all.max_component()
    }

    /// Whether any lobe is diffuse.
    #[inline]
    pub fn has_diffuse(&self) -> bool {
        self.lobes.iter().any(|lobe| lobe.bxdf.is_diffuse())
    }

    /// Probability with which [`Bsdf::sample`] draws from a specular lobe; 0 without lobes.
    #[inline]
    pub fn specular_share(&self, wo: Vec3) -> f32 {
        let chances = self.chances(self.frame.to_local(wo));
        let lobes = self.lobes.iter().zip(chances);
        lobes
            .filter(|(lobe, _)| lobe.bxdf.is_specular())
            .map(|(_, chance)| chance)
            .sum()
    }

    /// Whether [`Bsdf::sample`] draws from a specular lobe for this `u_lobe`.
    #[inline]
    pub fn draws_specular(&self, wo: Vec3, u_lobe: f32) -> bool {
        if self.lobes.is_empty() {
            return false;
        }
        let chances = self.chances(self.frame.to_local(wo));
        let (index, _) = choose(&chances[..self.lobes.len()], u_lobe);
        self.lobes[index].bxdf.is_specular()
    }

    /// Value for two directions of render space in sr⁻¹, cosine excluded. Whether they are reflected or transmitted is
    /// decided by the geometric normal, so that interpolated normals leak no light.
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let (wo_local, wi_local) = (self.frame.to_local(wo), self.frame.to_local(wi));
        self.f_local(wo_local, wi_local, self.reflects(wo, wi), mode)
    }

    #[inline]
    fn reflects(&self, wo: Vec3, wi: Vec3) -> bool {
        wi.dot(self.ng) * wo.dot(self.ng) > 0.0
    }

    fn f_local(&self, wo: Vec3, wi: Vec3, reflects: bool, mode: TransportMode) -> Rgb {
        if wo.z() == 0.0 {
            return Rgb::BLACK;
        }
        let reflects_in_shading = same_hemisphere(wo, wi);
        self.lobes
            .iter()
            .filter(|lobe| lobe.bxdf.sides().include(reflects, reflects_in_shading))
            .map(|lobe| lobe.bxdf.f(wo, wi, mode) * lobe.scale)
            .sum()
    }

    /// Density of [`Bsdf::sample`] in sr⁻¹ over the lobes that are not specular.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.seen_from(wo).pdf(wi)
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws the direction `wi` of render space for next-event estimation: that of
    /// its lobes without a delta, which it chooses among evenly. How light is shared between the two halves of its
    /// estimator is by this; directions are drawn otherwise here, see [`Bsdf::pdf`].
    pub fn pdf_in_pbrt(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = (self.frame.to_local(wo), self.frame.to_local(wi));
        if wo.z() == 0.0 {
            return 0.0;
        }
        let (mut sum, mut n_lobes) = (0.0, 0);
        for lobe in &self.lobes {
            lobe.bxdf.pdfs_in_pbrt(wo, wi, |pdf, n| {
                sum += pdf * n as f32;
                n_lobes += n;
            });
        }
        if n_lobes > 0 {
            sum / n_lobes as f32
        } else {
            0.0
        }
    }

    /// All lobes as they are seen from `wo`: for more than one question about that direction.
    #[inline]
    pub fn seen_from(&self, wo: Vec3) -> Seen<'_, 'a> {
        let wo_local = self.frame.to_local(wo);
        Seen {
            bsdf: self,
            wo,
            wo_local,
            chances: self.chances(wo_local),
        }
    }

    /// The probability with which each lobe is chosen: a share that all have alike, the rest by what they scatter.
    #[inline]
    fn chances(&self, wo: Vec3) -> Chances {
        let mut chances = [0.0; MAX_LOBES];
        if self.lobes.len() == 1 {
            chances[0] = 1.0;
            return chances;
        }
        let mut sum = 0.0;
        for (lobe, chance) in self.lobes.iter().zip(&mut chances) {
            *chance = (lobe.scale * lobe.bxdf.importance(wo)).max_component();
            sum += *chance;
        }
        let n_lobes = self.lobes.len() as f32;
        let (alike, factor) = if sum > 0.0 && sum.is_finite() {
            (CHOSEN_ALIKE / n_lobes, (1.0 - CHOSEN_ALIKE) / sum)
        } else {
            (1.0 / n_lobes, 0.0)
        };
        for chance in &mut chances[..self.lobes.len()] {
            *chance = alike + factor * chance.min(f32::MAX);
        }
        chances
    }

    /// |cos θ| of a direction to the shading normal.
    #[inline]
    pub fn abs_cos(&self, w: Vec3) -> f32 {
        w.abs_dot(self.frame.n)
    }

    /// Draws a direction: a lobe by `u_lobe`, then a direction of that lobe by what is left of `u_lobe` and by `u`.
    /// `None` where nothing scatters.
    pub fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        self.seen_from(wo).sample(u_lobe, u, mode)
    }

    /// All that specular lobes send on, in render space, once for each direction.
    pub fn specular_parts(
        &self,
        wo: Vec3,
        mode: TransportMode,
    ) -> ArrayVec<SpecularPart, MAX_SPECULAR_PARTS> {
        let mut parts = ArrayVec::<SpecularPart, MAX_SPECULAR_PARTS>::new();
        let wo_local = self.frame.to_local(wo);
        if wo_local.z() == 0.0 {
            return parts;
        }
        for lobe in &self.lobes {
            let of_lobe = lobe.bxdf.specular_parts(wo_local, mode);
            for part in of_lobe.into_iter().flatten() {
                let weight = part.weight * lobe.scale;
                match parts.iter_mut().find(|known| known.wi == part.wi) {
                    Some(known) => known.weight += weight,
                    None => parts.push(SpecularPart { weight, ..part }),
                }
            }
        }
        for part in &mut parts {
            part.wi = self.frame.to_world(part.wi);
        }
        parts
    }

    fn eta_scale(&self, wo: Vec3) -> f32 {
        if wo.dot(self.ng) > 0.0 {
            self.eta * self.eta
        } else {
            1.0 / (self.eta * self.eta)
        }
    }
}

/// A [`Bsdf`] as it is seen from one direction.
#[derive(Clone, Debug)]
pub struct Seen<'b, 'a> {
    bsdf: &'b Bsdf<'a>,
    wo: Vec3,
    wo_local: Vec3,
    chances: Chances,
}

impl Seen<'_, '_> {
    /// See [`Bsdf::f`].
    pub fn f(&self, wi: Vec3, mode: TransportMode) -> Rgb {
        let bsdf = self.bsdf;
        let reflects = bsdf.reflects(self.wo, wi);
        bsdf.f_local(self.wo_local, bsdf.frame.to_local(wi), reflects, mode)
    }

    /// See [`Bsdf::pdf`].
    pub fn pdf(&self, wi: Vec3) -> f32 {
        if self.wo_local.z() == 0.0 {
            return 0.0;
        }
        self.pdf_local(self.bsdf.frame.to_local(wi))
    }

    fn pdf_local(&self, wi: Vec3) -> f32 {
        let lobes = self.bsdf.lobes.iter().zip(&self.chances);
        lobes
            .map(|(lobe, chance)| chance * lobe.bxdf.pdf(self.wo_local, wi))
            .sum()
    }

    /// See [`Bsdf::pdf_in_pbrt`].
    pub fn pdf_in_pbrt(&self, wi: Vec3) -> f32 {
        self.bsdf.pdf_in_pbrt(self.wo, wi)
    }

    /// See [`Bsdf::sample`].
    pub fn sample(&self, u_lobe: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        let Self { bsdf, wo, .. } = *self;
        let wo_local = self.wo_local;
        if wo_local.z() == 0.0 || bsdf.lobes.is_empty() {
            return None;
        }
        let (index, u_part) = choose(&self.chances[..bsdf.lobes.len()], u_lobe);
        let chosen = &bsdf.lobes[index];
        match chosen.bxdf.sample(wo_local, u_part, u, mode)? {
            LobeSample::Specular(sample) => Some(BsdfSample {
                wi: bsdf.frame.to_world(sample.wi),
                weight: sample.weight * chosen.scale * (1.0 / self.chances[index]),
                pdf_w: 0.0,
                specular: true,
                transmitted: sample.transmitted,
                eta_scale: if sample.transmitted {
                    bsdf.eta_scale(wo)
                } else {
                    1.0
                },
            }),
            LobeSample::Smooth(wi_local) => {
                let pdf_w = self.pdf_local(wi_local);
                if pdf_w <= 0.0 {
                    return None;
                }
                let wi = bsdf.frame.to_world(wi_local);
                let reflects = bsdf.reflects(wo, wi);
                let f = bsdf.f_local(wo_local, wi_local, reflects, mode);
                Some(BsdfSample {
                    wi,
                    weight: f * (wi_local.z().abs() / pdf_w),
                    pdf_w,
                    specular: false,
                    transmitted: match chosen.bxdf.sides() {
                        Sides::Reflection => false,
                        Sides::Transmission => true,
                        Sides::Both | Sides::Each => !reflects,
                    },
                    eta_scale: 1.0,
                })
            }
        }
    }
}
