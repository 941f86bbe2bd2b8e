//! Lobes and the materials made of them: what is drawn follows its density, energy is neither made nor lost but where
//! the model says so, and light takes every way back.

mod cases;
mod density;
mod energy;
mod fresnel;
mod interfaces;
mod materials;
mod reciprocity;
