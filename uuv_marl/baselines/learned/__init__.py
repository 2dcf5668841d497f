"""Trained networks: from checkpoints to policies, and to ONNX."""
