//! The zero set: its extraction, the cells that it is extracted on, and what samples hand on to it.

pub(crate) mod extraction;
pub(crate) mod marching;
pub(crate) mod samples_around;
