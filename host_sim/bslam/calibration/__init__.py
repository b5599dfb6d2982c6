"""What a robot's own logs and pictures say of its wheels, sensors and cameras."""
