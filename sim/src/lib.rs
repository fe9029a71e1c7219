//! How a world *moves*.
