"""What a run was worth: errors, consistency, associations against the ground truth."""
