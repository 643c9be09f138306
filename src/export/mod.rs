//! Models for simulators, from a twin alone: URDF, MJCF, glTF.
