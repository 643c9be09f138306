//! Forward models: from a twin and an action to what every sensor would see. No capture: a simulator
//! cannot peek at what it must predict.
