"""Every fault that is promised to be survived, injected and measured: docs/FAULTS.md."""
