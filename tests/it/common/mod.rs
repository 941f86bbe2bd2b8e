//! What several kinds of tests share.

pub(crate) mod findings;
pub(crate) mod pictures;
pub(crate) mod probe;
pub(crate) mod scene;
pub(crate) mod seen;
pub(crate) mod solids;
