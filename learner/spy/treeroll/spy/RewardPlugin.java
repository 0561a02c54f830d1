package treeroll.spy;

import java.awt.Container;
import java.awt.event.ActionEvent;
import java.io.IOException;
import javax.swing.AbstractAction;
import javax.swing.Action;
import javax.swing.JDesktopPane;
import javax.swing.JInternalFrame;
import javax.swing.SwingUtilities;
import javax.swing.event.InternalFrameAdapter;
import javax.swing.event.InternalFrameEvent;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMSubscriber;
import lcm.spy.ChannelData;
import lcm.spy.SpyPlugin;
import treeroll.run_status_t;

/** What lcm-spy offers on a channel of run_status_t: "Reward by run". It finds this class itself. */
public final class RewardPlugin implements SpyPlugin {
  static final String TITLE = "Reward by run";

  @Override
  public boolean canHandle(long fingerprint) {
    return fingerprint == run_status_t.LCM_FINGERPRINT;
  }

  @Override
  public Action getAction(JDesktopPane desktop, ChannelData channel) {
    return new AbstractAction(TITLE) {
      @Override
      public void actionPerformed(ActionEvent event) {
        JInternalFrame frame = new JInternalFrame(channel.name, true, true, true);
        LCMSubscriber subscription = listen(channel.name, frame.getContentPane());
        frame.addInternalFrameListener(
            new InternalFrameAdapter() {
              @Override
              public void internalFrameClosed(InternalFrameEvent closed) {
                LCM.getSingleton().unsubscribe(channel.name, subscription);
              }
            });
        desktop.add(frame);
        frame.setSize(780, 540);
        frame.setVisible(true);
      }
    };
  }

  /** Draws what comes on a channel from now on. Learners say it again every few seconds. */
  static LCMSubscriber listen(String channel, Container place) {
    RewardChart chart = new RewardChart();
    place.add(chart);
    LCMSubscriber subscriber = (lcm, name, bytes) -> take(chart, bytes);
    LCM.getSingleton().subscribe(channel, subscriber);
    return subscriber;
  }

  /** In LCM's thread. */
  private static void take(RewardChart chart, LCMDataInputStream bytes) {
    try {
      run_status_t status = new run_status_t(bytes);
      SwingUtilities.invokeLater(() -> chart.take(status));
    } catch (IOException | RuntimeException notOurs) {
      // Of another version: lcm-spy's table counts it as an error.
    }
  }
}
