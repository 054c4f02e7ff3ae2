//! The leaf blade: a folded, curled ellipse as a small triangle mesh.
