"""Finding a user's own kinds of things: labelled pictures, training, figures, pages."""
