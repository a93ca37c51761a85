"""Frames traced by the machines of a Ray cluster.

    piece       what is sent to be traced, and what comes back
    worker      what runs on a node of the cluster: holds scenes, traces pieces, does tasks
    engine      a process of its own that talks to Ray, for `link`, which starts it and starts it again
    backlog     which worker does which piece, by their speeds
    cluster     the whole: a way to trace that `renderer.pipeline` takes, and tasks done by the workers

Ray ends a process whose cluster has lost its head. So none of it runs in the service's own: the engine may end, the
service says that it is not ready, and goes on with the next engine.
"""
