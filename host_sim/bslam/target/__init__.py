"""The core where it is meant to run: on a microcontroller, or an emulated one, over the link."""
