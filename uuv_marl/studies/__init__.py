"""The paper again, research on the model, and learned policies on what they were never trained on."""
