"""Pictures of scenes: cameras, lights, rendering, images, marks in them, and videos."""
