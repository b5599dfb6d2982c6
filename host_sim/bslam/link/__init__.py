"""The serial link to a robot: frames and messages. docs/LINK.md describes every byte."""
