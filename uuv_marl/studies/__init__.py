"""The paper again, research on the model, and all policies on held-out seeds and in disturbed water."""
