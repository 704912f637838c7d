"""Run jobs: settings, the pipeline from mesh to proof, and the folder that it leaves."""
