"""Trained networks: from their checkpoints to policies, and to ONNX."""
