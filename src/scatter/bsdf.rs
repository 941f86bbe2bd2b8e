//! The scattering function at a surface point: up to eight lobes in one shading frame.

use arrayvec::ArrayVec;

use crate::math::{Frame, Normal3, Vec3};
use crate::scatter::diffuse::Diffuse;
use crate::scatter::specular::{Mirror, SmoothDielectric, SpecularSample};
use crate::spectrum::Rgb;

/// What travels along the path: radiance from lights, or importance from the camera.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TransportMode {
    /// Paths that start at the camera.
    Radiance,
    /// Paths that start at a light.
    Importance,
}

/// One lobe, in the shading frame.
#[derive(Clone, Copy, Debug)]
pub enum Bxdf {
    /// Diffuse reflection.
    Diffuse(Diffuse),
    /// Mirror reflection.
    Mirror(Mirror),
    /// Smooth dielectric: specular reflection and transmission.
    SmoothDielectric(SmoothDielectric),
}

impl Bxdf {
    #[inline]
    fn is_specular(&self) -> bool {
        match self {
            Self::Diffuse(_) => false,
            Self::Mirror(_) | Self::SmoothDielectric(_) => true,
        }
    }
}

/// Most lobes a surface point may have.
pub const MAX_LOBES: usize = 8;

/// All lobes at a surface point.
#[derive(Clone, Debug)]
pub struct Bsdf {
    frame: Frame,
    ng: Normal3,
    /// Relative index of refraction that Russian roulette compensates for.
    eta: f32,
    lobes: ArrayVec<Bxdf, MAX_LOBES>,
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
    /// For a specular transmission: the factor that Russian roulette multiplies its throughput with to undo the
    /// change of solid angle; 1 otherwise.
    pub eta_scale: f32,
}

impl Bsdf {
    /// No lobes yet. `frame.n` is the shading normal, `eta` the relative index of the interface (1 if none).
    pub fn new(frame: Frame, ng: Normal3, eta: f32) -> Self {
        Self {
            frame,
            ng,
            eta,
            lobes: ArrayVec::new(),
        }
    }

    /// Adds a lobe; beyond [`MAX_LOBES`] it is dropped, which loading rules out.
    pub fn add(&mut self, lobe: Bxdf) {
        let added = self.lobes.try_push(lobe);
        debug_assert!(added.is_ok());
    }

    /// Whether light sampling can find anything here.
    #[inline]
    pub fn has_non_specular(&self) -> bool {
        self.lobes.iter().any(|lobe| !lobe.is_specular())
    }

    /// Value for two directions of render space in sr⁻¹, cosine excluded. Whether they are reflected or transmitted is
    /// decided by the geometric normal, so that interpolated normals leak no light.
    pub fn f(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> Rgb {
        let (wo_local, wi_local) = (self.frame.to_local(wo), self.frame.to_local(wi));
        self.f_local(wo_local, wi_local, self.reflects(wo, wi))
    }

    #[inline]
    fn reflects(&self, wo: Vec3, wi: Vec3) -> bool {
        wi.dot(self.ng) * wo.dot(self.ng) > 0.0
    }

    fn f_local(&self, wo: Vec3, wi: Vec3, reflects: bool) -> Rgb {
        if wo.z() == 0.0 {
            return Rgb::BLACK;
        }
        let mut f = Rgb::BLACK;
        for lobe in &self.lobes {
            match lobe {
                Bxdf::Diffuse(diffuse) if reflects => f += diffuse.f(wo, wi),
                _ => {}
            }
        }
        f
    }

    /// Density of [`Bsdf::sample`] in sr⁻¹ over the lobes that are not specular.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf_local(self.frame.to_local(wo), self.frame.to_local(wi))
    }

    fn pdf_local(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z() == 0.0 || self.lobes.is_empty() {
            return 0.0;
        }
        let mut pdf = 0.0;
        for lobe in &self.lobes {
            match lobe {
                Bxdf::Diffuse(diffuse) => pdf += diffuse.pdf(wo, wi),
                Bxdf::Mirror(_) | Bxdf::SmoothDielectric(_) => {}
            }
        }
        pdf / self.lobes.len() as f32
    }

    /// |cos θ| of a direction to the shading normal.
    #[inline]
    pub fn abs_cos(&self, w: Vec3) -> f32 {
        w.abs_dot(self.frame.n)
    }

    /// Draws a direction: a lobe uniformly by `u_lobe`, then a direction of that lobe. `None` where nothing scatters.
    pub fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let wo_local = self.frame.to_local(wo);
        if wo_local.z() == 0.0 || self.lobes.is_empty() {
            return None;
        }
        let n_lobes = self.lobes.len();
        let scaled = u_lobe * n_lobes as f32;
        let chosen = (scaled as usize).min(n_lobes - 1);
        match &self.lobes[chosen] {
            Bxdf::Mirror(mirror) => self.specular(wo, mirror.sample(wo_local)),
            Bxdf::SmoothDielectric(dielectric) => {
                self.specular(wo, dielectric.sample(wo_local, u[0], mode)?)
            }
            Bxdf::Diffuse(diffuse) => {
                let wi_local = diffuse.sample(wo_local, u);
                let wi = self.frame.to_world(wi_local);
                let pdf_w = self.pdf_local(wo_local, wi_local);
                if pdf_w <= 0.0 {
                    return None;
                }
                let f = self.f_local(wo_local, wi_local, self.reflects(wo, wi));
                let weight = f * (wi_local.z().abs() / pdf_w);
                Some(BsdfSample {
                    wi,
                    weight,
                    pdf_w,
                    specular: false,
                    eta_scale: 1.0,
                })
            }
        }
    }

    fn specular(&self, wo: Vec3, sample: SpecularSample) -> Option<BsdfSample> {
        let wi = self.frame.to_world(sample.wi);
        let eta_scale = if !sample.transmitted {
            1.0
        } else if wo.dot(self.ng) > 0.0 {
            self.eta * self.eta
        } else {
            1.0 / (self.eta * self.eta)
        };
        let weight = sample.weight * self.lobes.len() as f32;
        Some(BsdfSample {
            wi,
            weight,
            pdf_w: 0.0,
            specular: true,
            eta_scale,
        })
    }
}
